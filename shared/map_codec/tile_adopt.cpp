// SPDX-License-Identifier: Apache-2.0
#include "map_codec/tile_adopt.hpp"

#include <algorithm>

namespace crane {
namespace {

constexpr std::uint8_t kGrey = 128;

std::int8_t log_odds_of(unsigned cls) {
  constexpr std::int8_t kOf[] = {0, kMiss, kLogOddsMax, 0};
  return kOf[cls];
}

/// Where a height came from: one voxel, or two on top of each other (see tile_heights()).
void adopt_surface(std::size_t column, const ColumnHeight& c, Tile& tile, OccupancyMap& map) {
  const auto put = [&](double height_m) {
    const int z = map.index(height_m);
    const auto block = tile.blocks.find(tile_of(z));
    const int index = in_tile(z) * kTileColumns + static_cast<int>(column);
    if (block != tile.blocks.end() && block->second->at(index) == Occupancy::kOccupied)
      for (int view = 0; view < std::max<int>(1, c.views); ++view)  // so many have seen it
        map.observe_surface(*block->second, index, z, height_m, kGrey, kGrey, kGrey);
  };
  if (c.spread_m < 0.4 * map.voxel_m()) {
    put(c.height_m + c.spread_m);
    put(c.height_m - c.spread_m);
  } else {
    put(c.height_m);
  }
}

}  // namespace

void adopt_tile(TileKey key, const std::map<int, BlockClasses>& blocks, const TileHeights& heights,
                const std::function<Epoch(TimeNs)>& epoch_of, OccupancyMap& map) {
  Tile* const made = map.tile_if_room(key);
  if (made == nullptr) return;  // counted by the map
  Tile& tile = *made;
  TimeNs oldest = 0;
  for (const ColumnHeight& c : heights)
    if (c.last_observed != 0 && (oldest == 0 || c.last_observed < oldest)) oldest = c.last_observed;
  std::array<Epoch, kTileColumns> seen{};
  for (std::size_t i = 0; i < kTileColumns; ++i) {
    const TimeNs time = heights[i].last_observed;
    seen[i] = epoch_of(time != 0 ? time : oldest);
  }
  for (auto& [bz, block] : tile.blocks)  // what is no longer known of
    if (!blocks.contains(bz)) {
      block->log_odds.fill(0);
      block->seen.fill(0);
      block->settled.fill(0);
    }
  for (const auto& [bz, classes] : blocks) {
    Block* block = map.block(tile, bz);
    if (block == nullptr) continue;
    block->settled.fill(0);
    for (auto& layer : block->surface)
      if (layer) layer->fill({});
    for (std::size_t i = 0; i < kBlockVoxels; ++i) {
      block->log_odds[i] = log_odds_of(classes[i / 4] >> (2 * (i % 4)) & 3U);
      block->seen[i] = block->log_odds[i] == 0 ? Epoch{0} : seen[i % kTileColumns];
    }
  }
  for (std::size_t i = 0; i < kTileColumns; ++i) {
    const ColumnHeight& c = heights[i];
    Column& column = tile.columns[i];
    column.last_observed = c.last_observed;
    column.stale = c.state == ColumnState::kStale;
    column.proven_z = std::isfinite(c.proven_m)
                          ? static_cast<std::int16_t>(std::lround(c.proven_m / map.voxel_m()))
                          : Column::kNotProven;
    if (is_known(c.state)) adopt_surface(i, c, tile, map);
  }
  tile.reclassified = tile.moved = true;
  map.mark_changed(tile);
}

}  // namespace crane
