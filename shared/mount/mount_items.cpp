// SPDX-License-Identifier: Apache-2.0
#include "mount/mount_calibration.hpp"

#include <charconv>
#include <cmath>

namespace crane {
namespace {

constexpr MountItemName kNames[kMountItems] = {
    {"height_m", "camera above the floor", "m", 4},
    {"tilt_x_deg", "camera looks towards map +x", "deg", 3},
    {"tilt_y_deg", "camera looks towards map +y", "deg", 3},
    {"yaw_deg", "image's x axis against map x", "deg", 3},
    {"bridge_direction", "bridge's rangefinder", "", 0},
    {"trolley_direction", "trolley's rangefinder", "", 0},
    {"bridge_scale", "bridge's readings times", "", 5},
    {"trolley_scale", "trolley's readings times", "", 5},
    {"bridge_latency_ms", "bridge's readings come late by", "ms", 1},
    {"trolley_latency_ms", "trolley's readings come late by", "ms", 1},
    {"bridge_offset_m", "map x of a bridge's reading of 0", "m", 3},
    {"trolley_offset_m", "map y of a trolley's reading of 0", "m", 3},
    {"skew_deg", "bridge against square to the runway", "deg", 3},
    {"bridge_second_offset_m", "map x of the second rail's reading of 0", "m", 3},
    {"floor_slope_x_deg", "floor rises along map x", "deg", 3},
    {"floor_slope_y_deg", "floor rises along map y", "deg", 3},
    {"hook_x_m", "hook at rest, along the runway", "m", 3},
    {"hook_y_m", "hook at rest, along the bridge", "m", 3},
};

}  // namespace

const MountItemName& name_of(MountItem item) {
  return kNames[static_cast<std::size_t>(item)];
}

Result<FloorTarget> parse_floor_target(const std::string& text) {
  const Error bad{ErrorCode::kConfiguration, "floor target '" + text + "'", "is not X,Y,H",
                  "give the place of its middle in the map and its height in metres: 1.5,0.8,0.45"};
  FloorTarget target;
  double* to[3] = {&target.place_m.x(), &target.place_m.y(), &target.height_m};
  const char* at = text.data();
  const char* end = at + text.size();
  for (int i = 0; i < 3; ++i) {
    const auto [next, error] = std::from_chars(at, end, *to[i]);
    if (error != std::errc{} || !std::isfinite(*to[i])) return bad;
    if (i < 2 ? (next == end || *next != ',') : next != end) return bad;
    at = next + 1;
  }
  if (target.height_m < 0.02 || target.height_m > 50 || target.place_m.cwiseAbs().maxCoeff() > 1e4)
    return bad;
  return target;
}

}  // namespace crane
