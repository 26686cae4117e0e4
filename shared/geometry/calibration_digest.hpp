// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "geometry/stereo_rig.hpp"

namespace crane {

/// A number that two calibrations share only if they are the same: travels with frames and clouds,
/// so that nothing is made of them with another calibration. Never 0, which says nothing. Values
/// that differ by less than a rounding in the last digits of a YAML file are the same.
std::uint64_t calibration_digest(const StereoRig& rig);

/// Stands in stereo_frame.calibration for pictures that are to be looked at and never mapped: of no
/// calibration at all.
inline constexpr std::uint64_t kCalibrationForViewing = 1;

}  // namespace crane
