// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dds/topics.hpp"
#include "geometry/hoist_reading.hpp"

namespace crane::dds {

/// What a sample says of hook and load.
inline HoistReading hoist_reading(const v1::HoistState& h) {
  HoistReading r;
  r.time = h.time_ns();
  r.hook_height_m = h.hook_height_m();
  r.sling_m = h.sling_m();
  r.load_size_m = {h.load_size_x_m(), h.load_size_y_m(), h.load_size_z_m()};
  r.load_yaw_rad = h.load_yaw_rad();
  r.sway_m = {h.sway_x_m(), h.sway_y_m()};
  return r;
}

}  // namespace crane::dds
