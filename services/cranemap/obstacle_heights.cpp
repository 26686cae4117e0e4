// SPDX-License-Identifier: Apache-2.0
#include "obstacle_heights.hpp"

#include <algorithm>
#include <cmath>

namespace crane {

std::vector<ObstacleHeight> measure(const client::HeightGrid& grid,
                                    const std::vector<TrueObstacle>& obstacles) {
  std::vector<ObstacleHeight> out;
  for (const TrueObstacle& o : obstacles) {
    ObstacleHeight h;
    h.name = o.name;
    h.x_m = o.x_m;
    h.y_m = o.y_m;
    h.true_m = o.measured_height_m();
    h.level_m = o.level_radius_m();
    // What has a known end above measures; where hardly any has, what was seen has to do.
    std::vector<double> ends, heights;
    for (std::size_t i = 0; i < grid.cells.size(); ++i) {
      const client::Height& cell = grid.cells[i];
      if (!client::is_known(cell.surface) ||
          std::hypot(grid.x_m(i) - o.x_m, grid.y_m(i) - o.y_m) > 0.7 * o.level_radius_m())
        continue;
      heights.push_back(cell.height_m);
      if (!cell.lower_bound) ends.push_back(cell.height_m);
    }
    h.lower_bound = 10 * ends.size() < heights.size();
    if (!h.lower_bound) heights = std::move(ends);
    h.columns = heights.size();
    if (!heights.empty()) {
      const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
      std::nth_element(heights.begin(), middle, heights.end());
      h.measured_m = *middle;
    }
    out.push_back(h);
  }
  return out;
}

HeightMap to_height_map(const client::HeightGrid& grid) {
  HeightMap map;
  map.cell_m = grid.cell_m;
  map.origin_x_m = grid.origin_x_m;
  map.origin_y_m = grid.origin_y_m;
  map.columns = grid.columns;
  map.rows = grid.rows;
  map.height_mm.reserve(grid.cells.size());
  for (const client::Height& cell : grid.cells)
    map.height_mm.push_back(!client::is_known(cell.surface)
                                ? HeightMap::kNeverSeen
                                : static_cast<std::uint16_t>(std::lround(
                                      std::clamp(cell.height_m * 1000, 0.0, 65'534.0))));
  return map;
}

}  // namespace crane
