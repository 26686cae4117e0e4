// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "geometry/stereo_rig.hpp"

namespace crane {

/// Reads cam0/sensor.yaml, cam1/sensor.yaml (EuRoC: intrinsics, distortion, T_BS) and rig.yaml
/// (T_world_cam0) of a recording or calibration folder, and checks that a rig can work with it.
/// Error: Configuration, with every problem of a file and its line.
Result<StereoRig> read_rig(const std::string& folder);

/// A camera, and where it is in a body frame of the calibration's choice.
struct CameraInBody {
  CameraModel model;
  Eigen::Isometry3d T_body_camera = Eigen::Isometry3d::Identity();
};
/// One sensor.yaml; `name` for errors. Error: as read_rig().
Result<CameraInBody> parse_camera(const std::string& text, const std::string& name);

/// Writes the same three files. Error: Resource.
Result<void> write_rig(const StereoRig& rig, const std::string& folder, double rate_hz);

/// Lowest and highest distance and rate a rangefinder's sensor.yaml gives.
struct RangefinderModel {
  double accuracy_m = 0.003, range_m = 40, rate_hz = 20;
};
Result<RangefinderModel> read_rangefinder(const std::string& path);
/// Error: Resource.
Result<void> write_rangefinder(const std::string& path, const RangefinderModel& model);

}  // namespace crane
