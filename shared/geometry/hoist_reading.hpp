// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "base/clock.hpp"

namespace crane {

/// What the crane controller says of hook and load at one moment.
struct HoistReading {
  TimeNs time = 0;
  double hook_height_m = 0;                          ///< lowest point of the hook above the floor
  double sling_m = 0;                                ///< from there down to the top of the load
  Eigen::Vector3d load_size_m{0, 0, 0};              ///< along its own axes; a zero = no load
  double load_yaw_rad = 0;                           ///< about z, from map x
  Eigen::Vector2d sway_m = Eigen::Vector2d::Zero();  ///< hook minus where it hangs at rest

  [[nodiscard]] bool has_load() const { return load_size_m.minCoeff() > 0; }
};

}  // namespace crane
