// SPDX-License-Identifier: Apache-2.0
#include "client/height_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace crane::client {
namespace {

static_assert(int(Surface::kStale) == int(ColumnState::kStale) &&
              int(Surface::kObstacle) == int(ColumnState::kObstacle));

constexpr std::int64_t kAlwaysTiles = 4'000'000 / kTileColumns;
constexpr std::int64_t kTilesATile = 4;  // a hall that was seen along an L has as many

struct Window {
  TileKey low, high;
  [[nodiscard]] std::int64_t tiles() const {
    return (std::int64_t(high.x) - low.x + 1) * (std::int64_t(high.y) - low.y + 1);
  }
  [[nodiscard]] bool has(TileKey key) const {
    return low.x <= key.x && key.x <= high.x && low.y <= key.y && key.y <= high.y;
  }
  [[nodiscard]] Window with(TileKey key) const {
    return {{std::min(low.x, key.x), std::min(low.y, key.y)},
            {std::max(high.x, key.x), std::max(high.y, key.y)}};
  }
};

/// The middle of each axis by itself: half of the tiles would have to lie far off to move it there.
TileKey middle_of(std::vector<TileKey> keys) {
  const auto half = keys.begin() + std::ptrdiff_t(keys.size() / 2);
  std::nth_element(keys.begin(), half, keys.end(), [](auto a, auto b) { return a.x < b.x; });
  const int x = half->x;
  std::nth_element(keys.begin(), half, keys.end(), [](auto a, auto b) { return a.y < b.y; });
  return {x, half->y};
}

/// `keys`: one at least.
Window window_of(std::vector<TileKey> keys) {
  const std::int64_t most = std::max(kAlwaysTiles, kTilesATile * std::int64_t(keys.size()));
  const TileKey middle = middle_of(keys);
  const auto distance = [middle](TileKey k) {
    return std::max(std::abs(k.x - middle.x), std::abs(k.y - middle.y));
  };
  std::sort(keys.begin(), keys.end(),
            [&](TileKey a, TileKey b) { return distance(a) < distance(b); });
  Window window{keys.front(), keys.front()};
  for (const TileKey key : keys) {
    const Window larger = window.with(key);
    if (larger.tiles() > most) break;  // and all that are farther
    window = larger;
  }
  return window;
}

}  // namespace

Height to_height(const ColumnHeight& c) {
  Height h;
  h.surface = static_cast<Surface>(c.state);
  h.height_m = c.height_m;
  h.spread_m = c.spread_m;
  h.lower_bound = c.lower_bound;
  h.free_to_m = c.free_to_m;
  h.views = c.views;
  h.last_observed_ns = c.last_observed;
  h.proven_by_hook = std::isfinite(c.proven_m);
  if (h.proven_by_hook) h.proven_m = c.proven_m;
  return h;
}

HeightGrid height_grid(const HeldMap& held, double voxel_m) {
  HeightGrid grid;
  std::vector<TileKey> keys;
  for (const auto& [key, tile] : held.tiles())
    if (tile.heights_sample) keys.push_back(key);
  if (keys.empty()) return grid;
  const Window window = window_of(std::move(keys));
  grid.cell_m = voxel_m;
  grid.origin_x_m = window.low.x * kTileEdge * voxel_m;
  grid.origin_y_m = window.low.y * kTileEdge * voxel_m;
  grid.columns = static_cast<std::uint32_t>((window.high.x - window.low.x + 1) * kTileEdge);
  grid.rows = static_cast<std::uint32_t>((window.high.y - window.low.y + 1) * kTileEdge);
  grid.cells.resize(std::size_t(grid.columns) * grid.rows);
  for (const auto& [key, tile] : held.tiles()) {
    if (!tile.heights_sample) continue;
    if (!window.has(key)) {
      ++grid.tiles_left_out;
      continue;
    }
    for (std::size_t i = 0; i < kTileColumns; ++i) {
      const std::size_t column = std::size_t(key.x - window.low.x) * kTileEdge + i % kTileEdge;
      const std::size_t row = std::size_t(key.y - window.low.y) * kTileEdge + i / kTileEdge;
      grid.cells[row * grid.columns + column] = to_height(tile.heights.columns[i]);
    }
  }
  return grid;
}

}  // namespace crane::client
