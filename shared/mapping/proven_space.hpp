// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mapping/hoist.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

/// Where a box was, nothing else is: voxels wholly inside it, less `accuracy_m` on all sides,
/// become as free as can be, and their columns are marked as proven down to its underside. Returns
/// the number of voxels. Cost O(voxels of the box).
std::size_t prove_free(const UprightBox& box, double accuracy_m, OccupancyMap& map);

/// The same for what the box passes between two places, in steps of a voxel: of a slanting way
/// the border is left out by as much.
std::size_t prove_swept(const UprightBox& from, const UprightBox& to, double accuracy_m,
                        OccupancyMap& map);

}  // namespace crane
