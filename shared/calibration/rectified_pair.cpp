// SPDX-License-Identifier: Apache-2.0
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/report.hpp"
#include "imaging/convert.hpp"

namespace crane {

Image rectified_pair(const StereoCalibration& c, const Image& left, const Image& right) {
  for (const Image* image : {&left, &right})
    if (image->width != c.size.width || image->height != c.size.height) return {};
  const cv::Size size(static_cast<int>(c.size.width), static_cast<int>(c.size.height));
  cv::Mat K[2], D[2], R[2], P[2], R_right_left, t_right_left, Q;
  for (int eye = 0; eye < 2; ++eye) {
    const LensNumbers& l = eye == 0 ? c.rig.left : c.rig.right;
    K[eye] = (cv::Mat_<double>(3, 3) << l[0], 0, l[2], 0, l[1], l[3], 0, 0, 1);
    D[eye] = cv::Mat(1, 8, CV_64F, const_cast<double*>(l.data() + 4)).clone();
  }
  const Eigen::Isometry3d& T = c.rig.T_right_left;
  R_right_left = cv::Mat(3, 3, CV_64F);
  for (int i = 0; i < 9; ++i) R_right_left.at<double>(i / 3, i % 3) = T.linear()(i / 3, i % 3);
  const Eigen::Vector3d t = T.translation();
  t_right_left = (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z());
  cv::stereoRectify(K[0], D[0], K[1], D[1], size, R_right_left, t_right_left, R[0], R[1], P[0],
                    P[1], Q, cv::CALIB_ZERO_DISPARITY, 0);
  cv::Mat both(size.height, 2 * size.width, CV_8UC3);
  for (int eye = 0; eye < 2; ++eye) {
    std::vector<std::uint8_t> bytes;
    if (!to_bgr((eye == 0 ? left : right).view(), bytes)) return {};
    const cv::Mat colour(size, CV_8UC3, bytes.data());
    cv::Mat x, y, part = both(cv::Rect(eye * size.width, 0, size.width, size.height));
    cv::initUndistortRectifyMap(K[eye], D[eye], R[eye], P[eye], size, CV_16SC2, x, y);
    cv::remap(colour, part, x, y, cv::INTER_LINEAR);
  }
  for (int row = size.height / 24; row < size.height; row += size.height / 12)
    cv::line(both, {0, row}, {both.cols, row}, {60, 160, 255}, 1, cv::LINE_AA);
  Image out{static_cast<std::uint32_t>(both.cols), static_cast<std::uint32_t>(both.rows), 3, {}};
  out.bytes.assign(both.datastart, both.dataend);
  return out;
}

}  // namespace crane
