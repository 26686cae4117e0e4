// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "map_codec/compression.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

// All of a tile, for a mapper that goes on where it stopped: log-odds, surfaces, times; with its
// own CRC-32C. Only ever read by the same version.

/// The tile as it is now; quick, so that another thread can do the rest.
Bytes tile_bytes(const Tile& tile);
/// What is written to disk of those bytes.
Bytes pack_snapshot(const Bytes& tile_bytes);

/// Puts the tile into `map`. Error: BadData for anything pack_snapshot() does not make, or
/// Resource when it does not fit the map's memory limit.
Result<void> read_snapshot(std::span<const std::uint8_t> bytes, OccupancyMap& map);

}  // namespace crane
