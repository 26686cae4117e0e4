#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "base/result.hpp"

namespace crane {

/// Pinhole camera with radial-tangential distortion (k1 k2 p1 p2), as OpenCV and EuRoC define it.
struct CameraModel {
  std::uint32_t width = 0, height = 0;  ///< [px]
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;
};

/// Two cameras of one body. T_body_* map camera points (x right, y down, z forward) into the body.
struct StereoRig {
  CameraModel left, right;
  Eigen::Isometry3d T_body_left = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_body_right = Eigen::Isometry3d::Identity();
  /// Body (= left camera) in the map while cart and trolley read zero.
  Eigen::Isometry3d T_map_camera_at_zero = Eigen::Isometry3d::Identity();

  [[nodiscard]] Eigen::Isometry3d T_right_left() const {
    return T_body_right.inverse() * T_body_left;
  }
  [[nodiscard]] double baseline_m() const { return T_right_left().translation().norm(); }
  /// Height of the left camera's centre above the floor z = 0.
  [[nodiscard]] double camera_height_m() const {
    return (T_map_camera_at_zero * T_body_left).translation().z();
  }
};

/// Says what makes a rig unusable: focal lengths, baseline, rotation, sizes, a camera that looks
/// up.
Result<void> check_rig(const StereoRig& rig, const std::string& where);

/// One virtual pinhole that a rectified left image and its depth belong to.
struct RectifiedCamera {
  std::uint32_t width = 0, height = 0;  ///< [px]
  double f_px = 0, cx_px = 0, cy_px = 0, baseline_m = 0;
  Eigen::Matrix3d R_camera_rectified = Eigen::Matrix3d::Identity();
};

}  // namespace crane
