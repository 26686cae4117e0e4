// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <unordered_map>

#include "map_codec/compression.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

// OctoMap files straight from the blocks: no octree is built in memory. Checked voxel for voxel
// against OctoMap's own reader.

/// OctoMap binary tree (.bt): free and occupied, pruned. For octovis and every OctoMap reader.
Bytes write_bt(const OccupancyMap& map);

/// The classes of one block, as tiles carry them.
struct ClassBlock {
  TileKey tile;
  int z = 0;
  BlockClasses classes{};
};
/// The same of a map that was received.
Bytes write_bt(double voxel_m, std::span<const ClassBlock> blocks);

/// write_bt() again and again: keeps the bytes of each block, so that only what changed is encoded
/// anew. For large halls, where all but a few tiles stay as they are.
class BtWriter {
 public:
  /// To be told of every tile with a voxel that became free, occupied or unknown.
  void changed(TileKey key) { tiles_.erase(key); }
  /// The same bytes as write_bt(map).
  Bytes write(const OccupancyMap& map);

  /// A block's subtree.
  struct Subtree {
    Bytes bytes;
    std::uint8_t value = 0;  ///< what its parent says of it
    std::size_t nodes = 0;   ///< that it adds to the tree, itself not counted
  };

 private:
  std::unordered_map<TileKey, std::map<int, Subtree>, TileKeyHash> tiles_;
};

/// OctoMap ColorOcTree (.ot): log-odds and colour, pruned where log-odds are equal.
Bytes write_colour_ot(const OccupancyMap& map);

}  // namespace crane
