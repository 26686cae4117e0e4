// SPDX-License-Identifier: Apache-2.0
#include "stereo/rectification.hpp"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

namespace crane {
namespace {

cv::Mat intrinsics(const CameraModel& c) {
  return (cv::Mat_<double>(3, 3) << c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1);
}

/// In OpenCV's order.
cv::Mat distortion(const CameraModel& c) {
  switch (c.lens) {
    case LensModel::kEquidistant:
      return (cv::Mat_<double>(1, 4) << c.k1, c.k2, c.k3, c.k4);
    case LensModel::kRational:
      return (cv::Mat_<double>(1, 8) << c.k1, c.k2, c.p1, c.p2, c.k3, c.k4, c.k5, c.k6);
    case LensModel::kRadialTangential:
      break;
  }
  return (cv::Mat_<double>(1, 5) << c.k1, c.k2, c.p1, c.p2, c.k3);
}

struct Views {
  cv::Mat R_left, R_right, P_left, P_right;
};

Views views_of(const StereoRig& rig, cv::Size size) {
  const Eigen::Isometry3d T_right_left = rig.T_right_left();
  cv::Mat R(3, 3, CV_64F);
  cv::Mat t(3, 1, CV_64F);
  for (int r = 0; r < 3; ++r) {
    t.at<double>(r) = T_right_left.translation()[r];
    for (int c = 0; c < 3; ++c) R.at<double>(r, c) = T_right_left.linear()(r, c);
  }
  Views v;
  cv::Mat Q;
  if (rig.left.lens == LensModel::kEquidistant)
    cv::fisheye::stereoRectify(intrinsics(rig.left), distortion(rig.left), intrinsics(rig.right),
                               distortion(rig.right), size, R, t, v.R_left, v.R_right, v.P_left,
                               v.P_right, Q, cv::fisheye::CALIB_ZERO_DISPARITY);
  else
    cv::stereoRectify(intrinsics(rig.left), distortion(rig.left), intrinsics(rig.right),
                      distortion(rig.right), size, R, t, v.R_left, v.R_right, v.P_left, v.P_right,
                      Q, cv::CALIB_ZERO_DISPARITY, 0);
  return v;
}

void make_maps(const CameraModel& c, const cv::Mat& R, const cv::Mat& P, cv::Size size,
               cv::Mat (&maps)[2]) {
  if (c.lens == LensModel::kEquidistant)
    cv::fisheye::initUndistortRectifyMap(intrinsics(c), distortion(c), R, P, size, CV_16SC2,
                                         maps[0], maps[1]);
  else
    cv::initUndistortRectifyMap(intrinsics(c), distortion(c), R, P, size, CV_16SC2, maps[0],
                                maps[1]);
}

}  // namespace

Result<Rectification> rectification_of(const StereoRig& rig) {
  const cv::Size size(static_cast<int>(rig.left.width), static_cast<int>(rig.left.height));
  Rectification out;
  RectifiedCamera& camera = out.camera;
  try {
    const Views v = views_of(rig, size);
    make_maps(rig.left, v.R_left, v.P_left, size, out.left);
    make_maps(rig.right, v.R_right, v.P_right, size, out.right);
    camera.width = rig.left.width;
    camera.height = rig.left.height;
    camera.f_px = v.P_left.at<double>(0, 0);
    camera.cx_px = v.P_left.at<double>(0, 2);
    camera.cy_px = v.P_left.at<double>(1, 2);
    camera.baseline_m = -v.P_right.at<double>(0, 3) / v.P_right.at<double>(0, 0);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) camera.R_camera_rectified(r, c) = v.R_left.at<double>(c, r);
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kConfiguration, "calibration", "does not rectify: " + e.err,
                 "calibrate again"};
  }
  if (!std::isfinite(camera.f_px) || camera.f_px < 1 || !(camera.baseline_m > 0))
    return Error{ErrorCode::kConfiguration, "calibration",
                 "does not rectify (focal length " + std::to_string(camera.f_px) + " px)",
                 "calibrate again"};
  return out;
}

}  // namespace crane
