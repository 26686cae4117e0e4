// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>

#include "map_codec/tile_codec.hpp"

namespace crane {

/// Makes a tile of `map` what was published of it, for a mapper that takes over: classes become
/// log-odds, as sure as they may be; the highest surface of a column keeps its height. `epoch_of`:
/// the epoch of a time of observation. Blocks beyond the memory limit are counted by the map.
void adopt_tile(TileKey key, const std::map<int, BlockClasses>& blocks, const TileHeights& heights,
                const std::function<Epoch(TimeNs)>& epoch_of, OccupancyMap& map);

}  // namespace crane
