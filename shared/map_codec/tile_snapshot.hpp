#pragma once

#include "map_codec/compression.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

// All of a tile, for a mapper that goes on where it stopped: log-odds, surfaces, times; with its
// own CRC-32C. Only ever read by the same version.

Bytes write_snapshot(const Tile& tile);

/// Puts the tile into `map`. Error: BadData for anything write_snapshot() does not write, or
/// Resource when it does not fit the map's memory limit.
Result<void> read_snapshot(std::span<const std::uint8_t> bytes, OccupancyMap& map);

}  // namespace crane
