// SPDX-License-Identifier: Apache-2.0
#include "calibration/rays.hpp"

#include <opencv2/calib3d.hpp>

namespace crane {

std::vector<Eigen::Vector3d> rays(const LensNumbers& lens,
                                  const std::vector<Eigen::Vector2d>& pixels) {
  const cv::Matx33d K(lens[0], 0, lens[2], 0, lens[1], lens[3], 0, 0, 1);
  const cv::Mat D(1, 8, CV_64F, const_cast<double*>(lens.data() + 4));
  std::vector<cv::Point2d> seen;
  std::vector<cv::Point2d> plane;
  for (const auto& p : pixels) seen.emplace_back(p.x(), p.y());
  if (!seen.empty()) cv::undistortPoints(seen, plane, K, D);
  std::vector<Eigen::Vector3d> out;
  for (const auto& p : plane) out.emplace_back(p.x, p.y, 1);
  return out;
}

}  // namespace crane
