// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstring>

#include "mapping/occupancy_map.hpp"

namespace crane {

/// OctoMap's limits of log-odds.
inline constexpr int kOctomapMin = -64, kOctomapMax = 112;

/// Where Block::settled says of a cube, by its first voxel or any other of it.
constexpr std::size_t cube_index(int x, int y, int z) {
  return static_cast<std::size_t>((z / kCube * kCubesEdge + y / kCube) * kCubesEdge + x / kCube);
}

/// Voxels of one frame that were seen through. The tile learns of it at the end.
class Freeing {
 public:
  Freeing(Tile& tile, Epoch now, bool as_octomap)
      : tile_(tile), now_(now), least_(as_octomap ? kOctomapMin : kLogOddsMin) {}
  ~Freeing() {
    tile_.changed |= changed_;
    tile_.reclassified |= reclassified_;
  }
  Freeing(const Freeing&) = delete;
  Freeing& operator=(const Freeing&) = delete;

  void voxel(std::int8_t& log_odds, Epoch& seen) {
    seen = now_;
    const int before = log_odds;
    const int now = after_miss(before);
    log_odds = static_cast<std::int8_t>(now);
    changed_ |= now != before;
    reclassified_ |= classify(now) != classify(before);
  }
  /// Whether a row of a cube is as free as can be, and was seen in this epoch.
  [[nodiscard]] bool is_done(const std::int8_t* log_odds, const Epoch* seen) const {
    std::uint64_t odds = 0;
    std::uint64_t epochs = 0;
    std::memcpy(&odds, log_odds, sizeof odds);
    std::memcpy(&epochs, seen, sizeof epochs);
    return odds == kEach * static_cast<std::uint8_t>(least_) && epochs == kEach * now_;
  }
  /// A row of a cube. False when it was not yet as free as can be.
  bool row(std::int8_t* log_odds, Epoch* seen) {
    std::uint64_t odds = 0;
    std::uint64_t epochs = 0;
    std::memcpy(&odds, log_odds, sizeof odds);
    std::memcpy(&epochs, seen, sizeof epochs);
    if (epochs != kEach * now_) std::memset(seen, now_, kCube);
    if (odds == kEach * static_cast<std::uint8_t>(least_)) return true;
    std::int8_t before[kCube], now[kCube];
    std::memcpy(before, log_odds, kCube);
    bool reclassified = false;
    for (int i = 0; i < kCube; ++i) {
      now[i] = static_cast<std::int8_t>(after_miss(before[i]));
      reclassified |= classify(now[i]) != classify(before[i]);
    }
    std::memcpy(log_odds, now, kCube);
    changed_ = true;
    reclassified_ |= reclassified;
    return false;
  }

 private:
  /// One that is as free as can be stays so.
  [[nodiscard]] int after_miss(int log_odds) const {
    const int v = std::max(log_odds + kMiss, least_);
    return v == 0 ? -1 : v;
  }

  static constexpr std::uint64_t kEach = 0x0101010101010101ULL;
  Tile& tile_;
  Epoch now_;
  int least_;
  bool changed_ = false, reclassified_ = false;
};

/// Free voxels of a cube become unknown where its mask says so; masks[8 * z + y], bit x. True when
/// there were any.
inline bool take_back(Block& block, int x0, int y0, int z0, const std::uint8_t* masks) {
  bool any = false;
  for (int row = 0; row < kCube * kCube; ++row) {
    const auto at = static_cast<std::size_t>(
        ((z0 + row / kCube) * kTileEdge + y0 + row % kCube) * kTileEdge + x0);
    for (unsigned mask = masks[row]; mask != 0; mask &= mask - 1) {
      const std::size_t i = at + static_cast<std::size_t>(__builtin_ctz(mask));
      if (block.log_odds[i] >= 0) continue;
      block.log_odds[i] = 0;
      block.seen[i] = 0;
      any = true;
    }
  }
  if (any) block.settled[cube_index(x0, y0, z0)] = 0;
  return any;
}

/// Free voxels of a column below z become unknown: they were seen before what is there now came.
/// True when there were any.
inline bool take_back_below(Tile& tile, int column, int z) {
  bool any = false;
  for (const auto& [block_z, block] : tile.blocks) {
    const int layers = std::min(kTileEdge, z - block_z * kTileEdge);
    if (layers <= 0) break;
    for (int k = 0; k < layers; ++k) {
      const auto index = static_cast<std::size_t>(k * kTileColumns + column);
      if (block->log_odds[index] >= 0) continue;
      block->log_odds[index] = 0;
      block->seen[index] = 0;
      block->settled[cube_index(column % kTileEdge, column / kTileEdge, k)] = 0;
      any = true;
    }
  }
  return any;
}

}  // namespace crane
