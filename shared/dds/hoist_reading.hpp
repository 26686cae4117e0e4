// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bounds.h"
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

/// The sample that says it; who sends it adds crane and sequence number.
inline v1::HoistState hoist_state(const HoistReading& r) {
  v1::HoistState h;
  h.time_ns(r.time);
  h.hook_height_m(r.hook_height_m);
  h.sling_m(r.sling_m);
  h.load_size_x_m(r.load_size_m.x());
  h.load_size_y_m(r.load_size_m.y());
  h.load_size_z_m(r.load_size_m.z());
  h.load_yaw_rad(r.load_yaw_rad);
  h.sway_x_m(r.sway_m.x());
  h.sway_y_m(r.sway_m.y());
  h.status(v1::STATUS_OK);
  return h;
}

}  // namespace crane::dds
