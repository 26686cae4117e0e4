#pragma once

#include <functional>

#include "client/column_tile.hpp"
#include "crane/client/clearance.hpp"
#include "crane/client/zone.hpp"

namespace crane::client {

/// A map as clearance sees it. Tiles that are not there are unknown.
struct ColumnView {
  double voxel_m = 0;
  std::function<const ColumnTile*(TileKey)> voxels;
  std::function<const HeightColumns*(TileKey)> heights;
  const std::vector<Zone>* zones = nullptr;  ///< nullptr = none
};

/// What makes a query senseless, in words; empty = nothing.
std::string query_flaw(const ClearanceQuery& query, double voxel_m);

/// Is every voxel of the swept volume known to be free, and in no no-go zone? Cost O(swept
/// columns). Fills all but map_id and revision; `now_ns` is what ages are counted from.
Clearance check_clearance(const ClearanceQuery& query, const ColumnView& map, std::int64_t now_ns);

}  // namespace crane::client
