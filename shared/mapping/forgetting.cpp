// SPDX-License-Identifier: Apache-2.0
#include "mapping/forgetting.hpp"

#include <algorithm>

namespace crane {
namespace {

/// Looks at each tile within the time after which a voxel is forgotten: what is due is at most a
/// tenth late, and an epoch never comes round unseen.
constexpr double kLooks = 10;

bool any_old(const Epoch* seen, std::size_t count, Epoch now) {
  bool old = false;
  for (std::size_t i = 0; i < count; ++i)
    old |= seen[i] != 0 && age(seen[i], now) >= kEpochsToForget;
  return old;
}

/// Whether any voxel of a column is still believed to be occupied.
bool has_surface(const Tile& tile, std::size_t column) {
  return std::any_of(tile.blocks.begin(), tile.blocks.end(), [column](const auto& b) {
    for (std::size_t z = 0; z < kTileEdge; ++z)
      if (b.second->log_odds[z * kTileColumns + column] >= kBelieved) return true;
    return false;
  });
}

}  // namespace

std::uint64_t forget_old(Tile& tile, OccupancyMap& map) {
  const Epoch now = map.epoch();
  std::uint64_t forgotten = 0;
  std::array<bool, kTileColumns> lost{};
  for (const auto& [bz, block] : tile.blocks)
    for (std::size_t z = 0; z < kTileEdge; ++z) {
      const std::size_t layer = z * kTileColumns;
      if (!any_old(block->seen.data() + layer, kTileColumns, now)) continue;
      for (std::size_t c = 0; c < kTileColumns; ++c) {
        Epoch& seen = block->seen[layer + c];
        if (seen == 0 || age(seen, now) < kEpochsToForget) continue;
        std::int8_t& log_odds = block->log_odds[layer + c];
        lost[c] |= log_odds >= kBelieved;
        log_odds = 0;
        seen = 0;
        if (const auto& surface = block->surface[z]) (*surface)[c] = {};
        ++forgotten;
      }
    }
  if (forgotten == 0) return 0;
  for (const auto& [bz, block] : tile.blocks) block->settled.fill(0);
  for (std::size_t c = 0; c < kTileColumns; ++c)
    if (lost[c] && !has_surface(tile, c)) tile.columns[c].stale = true;
  tile.reclassified = true;
  map.mark_changed(tile);
  return forgotten;
}

void Forgetting::advance(TimeNs time, OccupancyMap& map) {
  if (!(after_s_ > 0)) return;
  map.set_epoch(epoch_at(time));
  const double passed_s = last_ == 0 ? 0 : double(time - last_) * 1e-9;
  last_ = time;
  const std::size_t tiles = map.tile_count();
  due_ = std::min(due_ + passed_s / after_s_ * kLooks * double(tiles), double(tiles));
  for (; due_ >= 1 && tiles > 0; due_ -= 1) {
    if (round_.empty()) round_ = map.tile_keys();
    Tile& tile = map.tile(round_.back());
    round_.pop_back();
    forgotten_ += forget_old(tile, map);
  }
}

}  // namespace crane
