// SPDX-License-Identifier: Apache-2.0
#include "calibration/epipolar.hpp"

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "calibration/rays.hpp"

namespace crane {
namespace {

/// Directions of pixels, turned into the rectified camera.
std::vector<Eigen::Vector3d> directions(const Corners& corners, const LensNumbers& lens,
                                        const Eigen::Matrix3d& R) {
  auto out = rays(lens, corners.pixels);
  for (auto& ray : out) ray = R * ray;
  return out;
}

}  // namespace

std::vector<std::vector<double>> row_differences(const std::vector<View>& views,
                                                 const RigEstimate& rig) {
  // Rows of the rectified pair lie along the baseline (Fusiello et al. 2000).
  const Eigen::Isometry3d T_left_right = rig.T_right_left.inverse();
  Eigen::Matrix3d R;
  R.row(0) = T_left_right.translation().normalized();
  R.row(1) = Eigen::Vector3d::UnitZ().cross(R.row(0).transpose()).normalized();
  R.row(2) = R.row(0).cross(R.row(1));
  std::vector<std::vector<double>> out(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].left.empty() || views[v].right.empty()) continue;
    const auto l = directions(views[v].left, rig.left, R);
    const auto r = directions(views[v].right, rig.right, R * T_left_right.linear());
    const auto& ids = views[v].right.ids;
    for (std::size_t i = 0, j = 0; i < l.size(); ++i) {
      while (j < ids.size() && ids[j] < views[v].left.ids[i]) ++j;
      if (j < ids.size() && ids[j] == views[v].left.ids[i])
        out[v].push_back(rig.left[1] * (l[i].y() / l[i].z() - r[j].y() / r[j].z()));
    }
  }
  return out;
}

Apart seen_apart(const View& view, const Board& board, const RigEstimate& rig) {
  const auto corners = board.corners();
  const Eigen::Vector3d middle = 0.5 * (corners.front() + corners.back());
  Apart out;
  Eigen::Vector3d at[2];
  for (const bool is_right : {false, true}) {
    const Corners& eye = is_right ? view.right : view.left;
    const LensNumbers& l = is_right ? rig.right : rig.left;
    const cv::Matx33d K(l[0], 0, l[2], 0, l[1], l[3], 0, 0, 1);
    const cv::Mat D(1, 8, CV_64F, const_cast<double*>(l.data() + 4));
    std::vector<cv::Point3d> objects;
    std::vector<cv::Point2d> pixels;
    std::vector<cv::Point2d> again;
    for (std::size_t i = 0; i < eye.ids.size(); ++i) {
      const auto& c = corners[static_cast<std::size_t>(eye.ids[i])];
      objects.emplace_back(c.x(), c.y(), c.z());
      pixels.emplace_back(eye.pixels[i].x(), eye.pixels[i].y());
    }
    cv::Mat turn, shift, R;
    cv::solvePnP(objects, pixels, K, D, turn, shift);
    cv::projectPoints(objects, turn, shift, K, D, again);
    double sum = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const cv::Point2d off = pixels[i] - again[i];
      sum += off.dot(off);
    }
    const double rms = std::sqrt(sum / (2.0 * static_cast<double>(pixels.size())));
    (is_right ? out.right_px : out.left_px) = rms;
    cv::Rodrigues(turn, R);
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    at[is_right ? 1 : 0] = Eigen::Map<const RowMajor>(R.ptr<double>()) * middle +
                           Eigen::Map<const Eigen::Vector3d>(shift.ptr<double>());
  }
  out.distance_m = (rig.T_right_left * at[0] - at[1]).norm();
  return out;
}

}  // namespace crane
