// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <unordered_map>
#include <utility>

#include "client/clearance_check.hpp"

namespace crane::client {

/// A map made voxel by voxel, to ask clearance of what comes from a file or a scene. No DDS.
class VoxelMap {
 public:
  /// `ceiling_m`: see ColumnView.
  explicit VoxelMap(double voxel_m, double ceiling_m = 0)
      : voxel_m_(voxel_m), ceiling_m_(ceiling_m) {}

  /// Voxel (x, y, z) covers [x, x + 1) * voxel_m and so on. Later ones replace earlier ones.
  void set(int x, int y, int z, Occupancy is) {
    Tile& tile = tiles_[{tile_of(x), tile_of(y)}];
    std::uint8_t& byte = tile.blocks[tile_of(z)][static_cast<std::size_t>(
        ((in_tile(z) * kTileEdge + in_tile(y)) * kTileEdge + in_tile(x)) / 4)];
    const int shift = 2 * (in_tile(x) % 4);
    byte = static_cast<std::uint8_t>((byte & ~(3 << shift)) | static_cast<int>(is) << shift);
    tile.finished = false;
  }
  /// Heights of a tile, where there are any: their times and views are what age and min_views ask.
  void set_heights(TileKey key, const TileHeights& heights) {
    Tile& tile = tiles_[key];
    tile.heights.columns = heights;
    tile.heights.sum_up();
    tile.has_heights = true;
  }

  /// For check_clearance(). Valid while this lives and is not changed. Cost O(voxels set).
  [[nodiscard]] ColumnView view() {
    for (auto& [key, tile] : tiles_)
      if (!std::exchange(tile.finished, true)) tile.columns = columns_of(tile.blocks);
    return {voxel_m_,
            [this](TileKey key) {
              const auto it = tiles_.find(key);
              return it == tiles_.end() ? nullptr : &it->second.columns;
            },
            [this](TileKey key) {
              const auto it = tiles_.find(key);
              return it == tiles_.end() || !it->second.has_heights ? nullptr : &it->second.heights;
            },
            nullptr, ceiling_m_};
  }

 private:
  struct Tile {
    std::map<int, BlockClasses> blocks;
    ColumnTile columns;
    HeightColumns heights;
    bool finished = false, has_heights = false;
  };
  double voxel_m_, ceiling_m_;
  std::unordered_map<TileKey, Tile, TileKeyHash> tiles_;
};

}  // namespace crane::client
