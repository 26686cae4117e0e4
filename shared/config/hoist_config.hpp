// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

class KeyVisitor;

/// Section `hoist`: hook, rope and load, which topic hoist_state places: cut out of what the
/// camera adds.
struct HoistConfig {
  bool enabled = false;
  double offset_x_m = 0, offset_y_m = 0;
  double rope_top_m = 0;
  double rope_radius_m = 0.1;
  double hook_x_m = 0.4, hook_y_m = 0.4, hook_z_m = 0.5;
  double margin_m = 0.15;
  double sway_m = 0.1;
  double largest_load_m = 3;
  double accuracy_m = 0.05;
  int max_gap_ms = 300;
};
void keys(KeyVisitor& v, HoistConfig& c);

}  // namespace crane
