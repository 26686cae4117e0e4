// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "map_codec/tile_codec.hpp"

namespace crane {

/// Columns of a row that are looked at together.
inline constexpr int kGroup = 8;
inline constexpr int kGroups = kTileColumns / kGroup;

/// One tile's heights, and of each group of columns when the oldest was seen and how often.
struct HeightColumns {
  TileHeights columns{};
  std::array<TimeNs, kGroups> oldest{};        ///< 0 = one was never seen
  std::array<std::uint8_t, kGroups> fewest{};  ///< frames that the least seen surface rests on

  void sum_up();  ///< to be called when columns have changed
};

/// One tile's voxels column by column, as bits from the lowest voxel up: what a load needs to be
/// free is an interval of them.
struct ColumnTile {
  int z0 = 0;                                 ///< voxel of bit 0
  int words = 0;                              ///< of 64 voxels, per column
  std::vector<std::uint64_t> free, occupied;  ///< [word][column]; neither: unknown

  /// The highest run of free voxels of a column, first .. end - 1, if nothing occupied is above it;
  /// else empty. Most questions are answered by it.
  struct Run {
    std::int16_t first = 0, end = 0;
  };
  std::vector<Run> top;  ///< by column; empty when there are no words
  /// What the runs of kGroup columns beside each other have in common; empty when one of them is.
  std::vector<Run> common;  ///< by group

  [[nodiscard]] bool is_free(int column, int z) const { return bit(free, column, z); }
  [[nodiscard]] bool is_occupied(int column, int z) const { return bit(occupied, column, z); }

 private:
  [[nodiscard]] bool bit(const std::vector<std::uint64_t>& bits, int column, int z) const {
    const int at = z - z0;
    if (at < 0 || at >= 64 * words) return false;
    return (bits[static_cast<std::size_t>(at / 64 * kTileColumns + column)] >> (at % 64) & 1U) != 0;
  }
};

/// Memory that columns_of() would take for blocks from height index `low` to `high` [bytes]: it
/// goes by the distance between them, not by how many there are.
std::size_t column_bytes(int low, int high);

/// `blocks`: by block height index.
ColumnTile columns_of(const std::map<int, BlockClasses>& blocks);

}  // namespace crane
