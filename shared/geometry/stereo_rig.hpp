// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

#include "base/result.hpp"

namespace crane {

/// How a lens bends rays; the coefficients are those of OpenCV.
enum class LensModel {
  kRadialTangential,  ///< k1 k2 p1 p2 k3 (Brown, Conrady)
  kRational,          ///< k1 k2 p1 p2 k3 k4 k5 k6
  kEquidistant,       ///< k1 k2 k3 k4: of powers of the angle (Kannala, Brandt), cv::fisheye's
};

/// Pinhole camera with a lens.
struct CameraModel {
  std::uint32_t width = 0, height = 0;  ///< [px]
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;
  int bits = 0;  ///< of a pixel, where image files have 16: 8 .. 16; 0 = not said
  LensModel lens = LensModel::kRadialTangential;
  double k3 = 0, k4 = 0, k5 = 0, k6 = 0;
};

/// Where the lens puts a ray, in units of the focal length from the principal point, without the
/// tangential part: of the tangent of its angle to the axis, of the angle itself for kEquidistant.
double lens_radius(const CameraModel& camera, double ray);

/// Two cameras on one mount. A calibration's body frame does not get in here: what is said of the
/// mount is said of the left camera, whatever body the calibration was made with.
/// Camera axes: x right, y down, z forward.
struct StereoRig {
  CameraModel left, right;
  /// Maps points of the right camera into the left one.
  Eigen::Isometry3d T_left_right = Eigen::Isometry3d::Identity();
  /// Left camera in the map while cart and trolley read zero.
  Eigen::Isometry3d T_map_camera_at_zero = Eigen::Isometry3d::Identity();

  [[nodiscard]] Eigen::Isometry3d T_right_left() const { return T_left_right.inverse(); }
  [[nodiscard]] double baseline_m() const { return T_left_right.translation().norm(); }
  /// Height of the left camera's centre above the floor z = 0.
  [[nodiscard]] double camera_height_m() const { return T_map_camera_at_zero.translation().z(); }
};

/// Whether a matrix turns and nothing else; says what else it does.
Result<void> check_rotation(const Eigen::Matrix3d& R, const std::string& where,
                            const std::string& name);

/// Says what makes a rig unusable or cannot be true: focal lengths, principal point and lens of
/// another image size, baseline, height (millimetres for metres), rotations, a camera that looks
/// up.
Result<void> check_rig(const StereoRig& rig, const std::string& where);

/// One virtual pinhole that a rectified left image and its depth belong to.
struct RectifiedCamera {
  std::uint32_t width = 0, height = 0;  ///< [px]
  double f_px = 0, cx_px = 0, cy_px = 0, baseline_m = 0;
  Eigen::Matrix3d R_camera_rectified = Eigen::Matrix3d::Identity();
};

}  // namespace crane
