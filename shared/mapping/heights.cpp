// SPDX-License-Identifier: Apache-2.0
#include "mapping/heights.hpp"

#include <algorithm>
#include <limits>

namespace crane {
namespace {

constexpr std::int16_t kNone = std::numeric_limits<std::int16_t>::min();

/// Noise of a surface, and what stands beside it, leave so many voxels above it unknown.
constexpr int kUncertain = 2;

/// Of each column: the highest occupied voxel, the highest that something was seen in which is not
/// believed yet, or no more, and the runs of free voxels above the occupied one.
struct Tops {
  std::array<std::int16_t, kTileColumns> occupied, contested;
  std::array<std::int16_t, kTileColumns> free_first, free_end;  ///< of the lowest run; first, end
  std::array<std::uint8_t, kTileColumns> runs;                  ///< 0, 1, or more
};

/// Layer by layer from above: 1024 columns at once.
Tops tops(const Tile& tile) {
  Tops top;
  top.occupied.fill(kNone);
  top.contested.fill(kNone);
  top.free_first.fill(kNone);
  top.free_end.fill(kNone);
  top.runs.fill(0);
  std::array<std::uint8_t, kTileColumns> in_run{};
  int expected = 0;  // the block that comes when none is missing
  for (auto it = tile.blocks.rbegin(); it != tile.blocks.rend(); ++it) {
    if (it->first != expected) in_run.fill(0);
    expected = it->first - 1;
    for (int z = kTileEdge - 1; z >= 0; --z) {
      const auto voxel_z = static_cast<std::int16_t>(it->first * kTileEdge + z);
      const auto above = static_cast<std::int16_t>(voxel_z + 1);
      const std::int8_t* layer = it->second->log_odds.data() + z * kTileColumns;
      for (std::size_t c = 0; c < kTileColumns; ++c) {
        const bool open = top.occupied[c] == kNone;
        const bool believed = layer[c] >= kBelieved;
        const bool seen = layer[c] > 0 && !believed;
        const bool free = open && layer[c] < 0;
        const bool begins = free && in_run[c] == 0;
        top.free_end[c] = begins ? above : top.free_end[c];
        top.free_first[c] = free ? voxel_z : top.free_first[c];
        top.runs[c] =
            static_cast<std::uint8_t>(begins && top.runs[c] < 2 ? top.runs[c] + 1 : top.runs[c]);
        in_run[c] = free ? 1 : 0;
        top.occupied[c] = believed && open ? voxel_z : top.occupied[c];
        top.contested[c] = seen && top.contested[c] == kNone ? voxel_z : top.contested[c];
      }
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
    const auto views_of = [&](int z) {
      const auto& layer = tile.blocks.at(tile_of(z))->surface[static_cast<std::size_t>(in_tile(z))];
      return layer ? (*layer)[column].weight : std::uint8_t{0};
    };
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
    c.views = views_of(top[column]);
    // The voxel below, if it holds the same surface.
    if (height_of(top[column] - 1, below_m) && c.height_m - below_m < 0.75 * voxel) {
      c.spread_m = 0.5 * (c.height_m - below_m);
      c.height_m = 0.5 * (c.height_m + below_m);
      c.views = std::max(c.views, views_of(top[column] - 1));
    }
    const int above = top[column] + 1;
    const bool free = all.runs[column] > 0 && all.free_first[column] <= above + kUncertain;
    const int free_end = free ? all.free_end[column] : above;
    c.free_to_m = free_end * voxel;
    c.lower_bound = free_end - above < voxels_above(voxel) || all.runs[column] != 1;
    c.state = c.height_m <= tolerance_m ? ColumnState::kFloor : ColumnState::kObstacle;
  }
  return out;
}

}  // namespace crane
