// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mapping/occupancy_map.hpp"
#include "mapping/surface_finder.hpp"

namespace crane {

/// What one frame's surface in a column says, and of which voxel.
struct Sighting {
  int z = 0;                            ///< the voxel
  int strength = kHit;                  ///< of its log-odds
  double height_m = 0;                  ///< for OccupancyMap::observe_surface()
  double share = OccupancyMap::kAlike;  ///< likewise
};

/// A surface that is as certain as half a voxel is one where it was measured. A less certain one
/// says less, by its variance, so that several are believed when their mean is certain. It joins
/// what is there within its uncertainty; and if the mean of all that joined lies in another voxel
/// by now, all of it moves there. Only a certain surface stays as it is.
Sighting settle(const SurfaceHit& hit, Tile& tile, OccupancyMap& map);
/// Asks the memory for what settle() and the update after it will read of this hit and those beside
/// it in the row of a tile; changes nothing.
void fetch_ahead(const SurfaceHit& hit, const Tile& tile, double voxel_m);

/// What was believed just above a surface that is seen with certainty, so near that no ray is known
/// to pass between, is contradicted: as often as a miss, and never further than to unknown.
void contradict_above(const SurfaceHit& hit, int z, Tile& tile, OccupancyMap& map);

}  // namespace crane
