#include "mapping/heights.hpp"

namespace crane {
namespace {

constexpr std::int16_t kNone = std::numeric_limits<std::int16_t>::min();

/// Of each column: the highest occupied voxel, and the highest that something was seen in which is
/// not believed yet, or no more.
struct Tops {
  std::array<std::int16_t, kTileColumns> occupied, contested;
};

/// Layer by layer from above: 1024 columns at once.
Tops tops(const Tile& tile) {
  Tops top;
  top.occupied.fill(kNone);
  top.contested.fill(kNone);
  for (auto it = tile.blocks.rbegin(); it != tile.blocks.rend(); ++it)
    for (int z = kTileEdge - 1; z >= 0; --z) {
      const auto voxel_z = static_cast<std::int16_t>(it->first * kTileEdge + z);
      const std::int8_t* layer = it->second->log_odds.data() + z * kTileColumns;
      for (std::size_t c = 0; c < kTileColumns; ++c) {
        const bool believed = layer[c] >= kBelieved;
        const bool seen = layer[c] > 0 && !believed;
        top.occupied[c] = believed && top.occupied[c] == kNone ? voxel_z : top.occupied[c];
        top.contested[c] = seen && top.contested[c] == kNone ? voxel_z : top.contested[c];
      }
    }
  return top;
}

}  // namespace

std::array<ColumnHeight, kTileColumns> tile_heights(const OccupancyMap& map, const Tile& tile,
                                                    double tolerance_m) {
  std::array<ColumnHeight, kTileColumns> out;
  const double voxel = map.voxel_m();
  const Tops all = tops(tile);
  const auto& top = all.occupied;
  for (std::size_t column = 0; column < kTileColumns; ++column) {
    ColumnHeight& c = out[column];
    const Column& known = tile.columns[column];
    c.last_observed = known.last_observed;
    if (known.proven_z != Column::kNotProven) c.proven_m = known.proven_z * voxel;
    // Something may stand on it: a voxel of noise apart, nobody knows how high it is.
    if (all.contested[column] > top[column] + 1) continue;
    if (top[column] == kNone) {
      if (known.stale) c.state = ColumnState::kStale;
      continue;
    }
    const auto height_of = [&](int z, double& height_m) {
      const auto block = tile.blocks.find(tile_of(z));
      if (block == tile.blocks.end()) return false;
      const int index = in_tile(z) * kTileColumns + static_cast<int>(column);
      if (block->second->at(index) != Occupancy::kOccupied) return false;
      height_m = map.surface_height_m(*block->second, index, z);
      return true;
    };
    double below_m = 0;
    height_of(top[column], c.height_m);
    c.spread_m = 0.5 * voxel;
    // The voxel below, if it holds the same surface.
    if (height_of(top[column] - 1, below_m) && c.height_m - below_m < 0.75 * voxel) {
      c.spread_m = 0.5 * (c.height_m - below_m);
      c.height_m = 0.5 * (c.height_m + below_m);
    }
    c.state = c.height_m <= tolerance_m ? ColumnState::kFloor : ColumnState::kObstacle;
  }
  return out;
}

}  // namespace crane
