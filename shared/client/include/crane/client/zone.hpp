// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace crane::client {

/// A piece of the hall from z_min_m to z_max_m over a simple polygon, map frame.
struct Zone {
  enum class Kind { kNoGo = 1, kSlowDown = 2 };
  struct Corner {
    double x_m = 0, y_m = 0;
  };
  std::uint32_t id = 0;
  Kind kind = Kind::kNoGo;
  bool active = false, switchable = false;
  double z_min_m = 0, z_max_m = 0;
  std::string name;
  std::vector<Corner> corners;
};

}  // namespace crane::client
