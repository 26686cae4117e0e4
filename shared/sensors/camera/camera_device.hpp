// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "config/camera_config.hpp"
#include "geometry/stereo_rig.hpp"
#include "sensors/camera/stereo_device.hpp"

namespace crane {

/// The live camera that the configuration names, not yet opened; nullptr for a recording. `rig`:
/// its calibration, if one was given. `most_pixels`: of an image. Error: Configuration for sizes
/// that do not fit; Resource for what is not installed.
Result<std::unique_ptr<StereoDevice>> make_camera_device(const CameraConfig& config,
                                                         const std::optional<StereoRig>& rig,
                                                         std::uint64_t most_pixels);

}  // namespace crane
