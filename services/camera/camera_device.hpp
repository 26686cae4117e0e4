#pragma once

#include <memory>
#include <optional>

#include "config/camera_config.hpp"
#include "geometry/stereo_rig.hpp"
#include "sensors/camera/stereo_device.hpp"

namespace crane {

/// The live camera that the configuration names. `rig`: its calibration, if one was given.
/// Error: Configuration for sizes that do not fit; Resource for what is not installed.
Result<std::unique_ptr<StereoDevice>> make_camera_device(const CameraConfig& config,
                                                         const std::optional<StereoRig>& rig);

}  // namespace crane
