#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "obstacle_heights.hpp"

namespace crane {

/// The height map as people look at it: from above, y up, colour = height, unknown hatched,
/// metres on both axes, zones, obstacles with their measured heights. Error: Resource.
Result<void> draw_heights(const std::string& png_path, const client::HeightGrid& grid,
                          const std::vector<ObstacleHeight>& obstacles,
                          const std::vector<client::Zone>& zones, const std::string& title);

}  // namespace crane
