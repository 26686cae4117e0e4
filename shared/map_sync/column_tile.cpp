// SPDX-License-Identifier: Apache-2.0
#include "map_sync/column_tile.hpp"

#include <algorithm>
#include <limits>

namespace crane {

namespace {

int words_of(int low, int high) {
  return ((high - low + 1) * kTileEdge + 63) / 64;
}

}  // namespace

std::size_t column_bytes(int low, int high) {
  return std::size_t(words_of(low, high)) * kTileColumns * 2 * sizeof(std::uint64_t) +
         (kTileColumns + kGroups) * sizeof(ColumnTile::Run);
}

ColumnTile columns_of(const std::map<int, BlockClasses>& blocks) {
  ColumnTile out;
  if (blocks.empty()) return out;
  const int low = blocks.begin()->first;
  const int high = blocks.rbegin()->first;
  out.z0 = low * kTileEdge;
  out.words = words_of(low, high);
  out.free.assign(static_cast<std::size_t>(kTileColumns * out.words), 0);
  out.occupied.assign(out.free.size(), 0);
  for (const auto& [bz, classes] : blocks)
    for (int z = 0; z < kTileEdge; ++z) {
      const int at = bz * kTileEdge + z - out.z0;
      const std::uint64_t bit = std::uint64_t{1} << (at % 64);
      const std::uint8_t* layer = classes.data() + z * kTileColumns / 4;
      for (int i = 0; i < kTileColumns / 4; ++i) {
        if (layer[i] == 0) continue;
        for (int k = 0; k < 4; ++k) {
          const unsigned c = layer[i] >> (2 * k) & 3U;
          const auto word = static_cast<std::size_t>(at / 64 * kTileColumns + 4 * i + k);
          if (c == static_cast<unsigned>(Occupancy::kFree)) out.free[word] |= bit;
          if (c == static_cast<unsigned>(Occupancy::kOccupied)) out.occupied[word] |= bit;
        }
      }
    }
  out.top.resize(kTileColumns);
  for (int column = 0; column < kTileColumns; ++column) {
    int z = out.z0 + 64 * out.words - 1;
    while (z >= out.z0 && !out.is_free(column, z) && !out.is_occupied(column, z)) --z;
    if (z < out.z0 || !out.is_free(column, z)) continue;
    const int end = z + 1;
    while (z >= out.z0 && out.is_free(column, z)) --z;
    out.top[static_cast<std::size_t>(column)] = {static_cast<std::int16_t>(z + 1),
                                                 static_cast<std::int16_t>(end)};
  }
  out.common.resize(kGroups);
  for (int column = 0; column < kTileColumns; ++column) {
    const ColumnTile::Run& run = out.top[static_cast<std::size_t>(column)];
    ColumnTile::Run& common = out.common[static_cast<std::size_t>(column / kGroup)];
    if (column % kGroup == 0) common = run;
    const bool none = run.first >= run.end || common.first >= common.end;
    common.first = none ? std::int16_t{0} : std::max(common.first, run.first);
    common.end = none ? std::int16_t{0} : std::min(common.end, run.end);
  }
  return out;
}

void HeightColumns::sum_up() {
  for (std::size_t g = 0; g < oldest.size(); ++g) {
    oldest[g] = columns[g * kGroup].last_observed;
    fewest[g] = std::numeric_limits<std::uint8_t>::max();
    for (std::size_t i = 0; i < kGroup; ++i) {
      const ColumnHeight& c = columns[g * kGroup + i];
      oldest[g] = std::min(oldest[g], c.last_observed);
      fewest[g] = std::min(fewest[g], is_known(c.state) ? c.views : std::uint8_t{0});
    }
  }
}

}  // namespace crane
