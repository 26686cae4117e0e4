// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace crane {

class KeyVisitor;

/// Of list `zones`: a no-go or slow-down zone, fixed or switchable by topic zone_command.
struct ZoneConfig {
  struct Corner {
    double x_m = 0, y_m = 0;
  };
  int id = 0;  ///< 1 ..
  std::string name;
  bool slow_down = false;
  bool active = true, switchable = false;
  double z_min_m = -100, z_max_m = 1000;
  std::vector<Corner> corners;
};
inline constexpr std::size_t kMostZones = 64;

/// All of them: what one must be, and what two may not have in common.
void keys(KeyVisitor& v, std::vector<ZoneConfig>& zones);

}  // namespace crane
