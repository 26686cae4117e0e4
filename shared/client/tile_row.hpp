// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "client/clearance_check.hpp"

namespace crane::client {

/// The tiles under one row of tiles, looked up once.
class TileRow {
 public:
  explicit TileRow(const ColumnView& map) : map_(map) {}
  struct Pair {
    const ColumnTile* voxels = nullptr;
    const HeightColumns* heights = nullptr;
  };
  const Pair& at(int tile_x, int tile_y) {
    if (tile_y != y_) {
      y_ = tile_y;
      x0_ = tile_x;
      tiles_.clear();
    }
    if (tile_x < x0_) {
      tiles_.insert(tiles_.begin(), std::size_t(x0_ - tile_x), std::nullopt);
      x0_ = tile_x;
    }
    const auto i = std::size_t(tile_x - x0_);
    if (i >= tiles_.size()) tiles_.resize(i + 1);
    if (!tiles_[i]) tiles_[i] = Pair{map_.voxels({tile_x, tile_y}), map_.heights({tile_x, tile_y})};
    return *tiles_[i];
  }

 private:
  const ColumnView& map_;
  int y_ = std::numeric_limits<int>::min(), x0_ = 0;
  std::vector<std::optional<Pair>> tiles_;
};

}  // namespace crane::client
