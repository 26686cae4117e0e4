// SPDX-License-Identifier: Apache-2.0
#include "map_sync/owed_tiles.hpp"

namespace crane {

void OwedTiles::note(TileKey key, Lack lack, Clock::time_point now) {
  if (!lack.voxels && !lack.heights) return;
  if (const auto sent = sent_.find(key); sent != sent_.end()) {
    if (now - sent->second < kPause) return;
    sent_.erase(sent);
  }
  Lack& owed = owed_[key];
  owed.voxels |= lack.voxels;
  owed.heights |= lack.heights;
}

std::optional<OwedTiles::Owed> OwedTiles::next(Clock::time_point now) {
  if (owed_.empty()) return std::nullopt;
  const auto first = owed_.begin();
  const Owed out{first->first, first->second};
  owed_.erase(first);
  sent_[out.key] = now;
  return out;
}

}  // namespace crane
