// SPDX-License-Identifier: Apache-2.0
#include "config/hoist_config.hpp"

#include "config/key.hpp"

namespace crane {

void keys(KeyVisitor& v, HoistConfig& c) {
  v.flag({"enabled",
          "cut out rope, hook and load; then without hoist_state nothing below the trolley is "
          "mapped"},
         c.enabled);
  v.number({"offset_x_m", "hook at rest minus cart, in the map"}, c.offset_x_m, {-100, 100});
  v.number({"offset_y_m", "hook at rest minus trolley, in the map"}, c.offset_y_m, {-100, 100});
  v.number(Key("rope_top_m", "upper end of the rope").by_default("0: the camera's height"),
           c.rope_top_m, {0, 200});
  v.number({"rope_radius_m", "of all falls together"}, c.rope_radius_m, {0, 5});
  v.number({"hook_x_m", "of the hook block"}, c.hook_x_m, {0.01, 10});
  v.number({"hook_y_m", "of the hook block"}, c.hook_y_m, {0.01, 10});
  v.number({"hook_z_m", "of the hook block"}, c.hook_z_m, {0.01, 10});
  v.number({"margin_m", "around everything"}, c.margin_m, {0, 5});
  v.number({"sway_m", "that the controller does not know of"}, c.sway_m, {0, 10});
  v.number({"largest_load_m", "side of the largest load: cut out while nothing is known"},
           c.largest_load_m, {0, 50});
  v.number({"accuracy_m", "of heights and sizes: so much less is proven free"}, c.accuracy_m,
           {0, 2});
  v.integer({"max_gap_ms", "no hoist_state for longer: lost"}, c.max_gap_ms, {50, 10'000});
}

}  // namespace crane
