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
};

constexpr bool is_known(ColumnState state) {
  return state == ColumnState::kFloor || state == ColumnState::kObstacle;
}

/// Heights of a tile's 32 x 32 columns, index y * 32 + x. A surface within
/// `floor_tolerance_m` of z = 0 is the floor. Cost O(voxels of the tile).
std::array<ColumnHeight, kTileColumns> tile_heights(const OccupancyMap& map, const Tile& tile,
                                                    double floor_tolerance_m);

/// What counts as floor: 1.5 voxels, as maps are judged; never less than 2 cm.
constexpr double floor_tolerance_m(double voxel_m) {
  return voxel_m > 0.0134 ? 1.5 * voxel_m : 0.02;
}

}  // namespace crane
