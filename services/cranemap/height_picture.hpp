// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "obstacle_heights.hpp"

namespace crane {

/// What a picture of a map that lives says beside its heights.
struct LiveOverlay {
  struct Point {
    double x_m = 0, y_m = 0;
  };
  std::optional<Point> crane;     ///< cart and trolley
  std::vector<Point> footprint;   ///< what the camera sees of the floor, a polygon
  std::vector<std::string> foot;  ///< lines below
  std::string warning;            ///< across the top, red; empty: none
  TimeNs now = 0;                 ///< ages count from here
  bool ages = false;              ///< colours are ages, not heights
};

/// The height map as people look at it: from above, y up, colour = height, unknown hatched,
/// metres on both axes, zones, obstacles with their measured heights. Error: Resource.
Result<void> draw_heights(const std::string& png_path, const client::HeightGrid& grid,
                          const std::vector<ObstacleHeight>& obstacles,
                          const std::vector<client::Zone>& zones, const std::string& title,
                          const LiveOverlay* live = nullptr);

/// The colour of a height, 0 (lowest) .. 1, as in the picture: red, green, blue.
std::array<std::uint8_t, 3> height_colour(double share);

}  // namespace crane
