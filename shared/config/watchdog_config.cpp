// SPDX-License-Identifier: Apache-2.0
#include "config/watchdog_config.hpp"

#include "config/key.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

/// From where on it is said, and from where on nothing is mapped.
void pair(KeyVisitor& v, const Key& drifting, double& drifting_at, const char* wrong,
          double& wrong_at, const Range& range) {
  v.number(drifting, drifting_at, range);
  v.number({wrong, "likewise; from here on nothing is mapped"}, wrong_at, range);
  YamlReader* y = v.reading();
  if (y != nullptr && wrong_at < drifting_at)
    y->problem(wrong, "must not be less than " + drifting.name);
}

}  // namespace

void keys(KeyVisitor& v, WatchdogConfig& c) {
  v.flag({"enabled", "test calibration and positions against what the camera sees"}, c.enabled);
  pair(v, {"height_drifting_percent", "height of the floor, and depths, of themselves: said"},
       c.height_drifting_percent, "height_wrong_percent", c.height_wrong_percent, {0.05, 100});
  pair(v, {"tilt_drifting_deg", "tilt of the camera's mount: said"}, c.tilt_drifting_deg,
       "tilt_wrong_deg", c.tilt_wrong_deg, {0.01, 90});
  pair(v, {"roll_drifting_deg", "roll of the right camera: said"}, c.roll_drifting_deg,
       "roll_wrong_deg", c.roll_wrong_deg, {0.005, 90});
  pair(v, {"rows_drifting_px", "right image lower or higher: said"}, c.rows_drifting_px,
       "rows_wrong_px", c.rows_wrong_px, {0.05, 100});
  pair(v, {"scale_drifting_percent", "scale of a rangefinder: said"}, c.scale_drifting_percent,
       "scale_wrong_percent", c.scale_wrong_percent, {0.05, 100});
  pair(v, {"turn_drifting_deg", "turn of the image against the rails: said"}, c.turn_drifting_deg,
       "turn_wrong_deg", c.turn_wrong_deg, {0.01, 90});
  pair(v, {"delay_drifting_ms", "rangefinder against camera: said"}, c.delay_drifting_ms,
       "delay_wrong_ms", c.delay_wrong_ms, {1, 1000});
  v.number({"jump_m", "a frame so far beside its positions is not used; three: wrong"}, c.jump_m,
           {0.005, 10});
}

}  // namespace crane
