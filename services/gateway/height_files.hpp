// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "crane/client/map.hpp"

namespace crane::gateway {

/// A grid as files. Rows of the texts as in HeightGrid, the lowest y first; of the picture the
/// highest y first, as the world file says.
std::string heights_json(const client::HeightGrid& grid, const std::string& map, TimeNs now);
/// One line a column that was ever seen: x, y, surface, height, lower bound, views, age.
std::string heights_csv(const client::HeightGrid& grid, TimeNs now);
/// 16-bit PNG, millimetres above the floor (pits 0), 65535 = unknown. Error: Resource.
Result<std::string> heights_png(const client::HeightGrid& grid);
/// ESRI world file of that picture: pixels to metres of the map.
std::string heights_world_file(const client::HeightGrid& grid);

}  // namespace crane::gateway
