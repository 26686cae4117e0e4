#pragma once

#include "map_codec/compression.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

// OctoMap files straight from the blocks: no octree is built in memory. Checked voxel for voxel
// against OctoMap's own reader.

/// OctoMap binary tree (.bt): free and occupied, pruned. For octovis and every OctoMap reader.
Bytes write_bt(const OccupancyMap& map);

/// OctoMap ColorOcTree (.ot): log-odds and colour, pruned where log-odds are equal.
Bytes write_colour_ot(const OccupancyMap& map);

}  // namespace crane
