// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "geometry/stereo_rig.hpp"

namespace crane {

/// The four corners of the left image on the floor z = 0 [m, map], lens distortion aside, while
/// cart and trolley are at `gantry_m`; empty where the camera sees beyond the horizon.
std::vector<Eigen::Vector2d> footprint(const StereoRig& rig, const Eigen::Vector2d& gantry_m);

}  // namespace crane
