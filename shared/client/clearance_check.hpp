// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "client/clearance_query.hpp"
#include "map_sync/column_tile.hpp"

namespace crane::client {

/// A map as clearance sees it. Tiles that are not there are unknown.
struct ColumnView {
  double voxel_m = 0;
  std::function<const ColumnTile*(TileKey)> voxels;
  std::function<const HeightColumns*(TileKey)> heights;
  const std::vector<Zone>* zones = nullptr;  ///< nullptr = none
  /// Up to here kToRopeTop reaches; 0 = not said: such queries are refused.
  double ceiling_m = 0;
};

/// Voxels that only this share of their edge is swept of are not: by rounding, no more.
inline constexpr double kRounding = 1e-6;

/// Is every voxel of the swept volume known to be free, and in no no-go zone? Heights only say
/// where in its voxel the surface below ends; they never make space free. No DDS, no clock, no
/// state. Cost O(swept columns), bounded by query_flaw(). Fills all but map_id and revision;
/// `now_ns` is what ages are counted from.
Clearance check_clearance(const ClearanceQuery& query, const ColumnView& map, std::int64_t now_ns);

}  // namespace crane::client
