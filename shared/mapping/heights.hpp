// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>

#include "mapping/occupancy_map.hpp"

namespace crane {

enum class ColumnState : std::uint8_t {
  kUnknown = 0,   ///< never seen: not free
  kFloor = 1,     ///< the highest surface is the floor
  kObstacle = 2,  ///< something stands here
  kStale = 3,     ///< not seen again for too long: unknown, what was here is forgotten
};

/// The highest surface of one map column, finer than a voxel.
struct ColumnHeight {
  double height_m = 0;  ///< map z; of no meaning while unknown or stale
  double spread_m = 0;  ///< half the distance of the voxels it was made of
  ColumnState state = ColumnState::kUnknown;
  TimeNs last_observed = 0;
  /// Hook or load have been here, down to this height [m], since a surface was last seen higher;
  /// not finite: they have not.
  double proven_m = std::numeric_limits<double>::infinity();
  /// Frames that saw this surface, to 32: one alone may be one mistake of the matcher.
  std::uint8_t views = 0;
  /// From the surface up to here the column is known to be free (but for two voxels of noise right
  /// above it); of no meaning while unknown or stale. What is higher was never seen.
  double free_to_m = 0;
  /// The true height may be more: the space right above the surface was never seen to be free, or
  /// there is a gap in what was, and something may hang in it.
  bool lower_bound = false;
};

constexpr bool is_known(ColumnState state) {
  return state == ColumnState::kFloor || state == ColumnState::kObstacle;
}

/// Heights of a tile's 32 x 32 columns, index y * 32 + x. A surface within
/// `floor_tolerance_m` of z = 0 is the floor. Cost O(voxels of the tile).
std::array<ColumnHeight, kTileColumns> tile_heights(const OccupancyMap& map, const Tile& tile,
                                                    double floor_tolerance_m);

/// So much free space above a surface shows where it ends: 20 cm, two voxels at least. Rays that
/// pass beside a thing's upper end free hardly more above what they hit lower down.
constexpr int voxels_above(double voxel_m) {
  return voxel_m > 0.1 ? 2 : static_cast<int>(0.2 / voxel_m + 0.999);
}

/// What counts as floor: 1.5 voxels, as maps are judged; never less than 2 cm.
constexpr double floor_tolerance_m(double voxel_m) {
  return voxel_m > 0.0134 ? 1.5 * voxel_m : 0.02;
}

}  // namespace crane
