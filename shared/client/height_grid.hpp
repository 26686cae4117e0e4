// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "crane/client/map.hpp"
#include "map_sync/held_map.hpp"

namespace crane::client {

Height to_height(const ColumnHeight& column);

/// Heights that are held, as a grid around them. When two tiles lie so far apart that it would have
/// far more cells than columns are held, it is made around the middle tile, of the nearest ones
/// only. Cost and memory O(what is held), four million cells at least.
HeightGrid height_grid(const HeldMap& held, double voxel_m);

}  // namespace crane::client
