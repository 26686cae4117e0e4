// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "crane/client/clearance.hpp"
#include "map_sync/held_map.hpp"

namespace crane::client {

/// The highest surface of the columns that touch the area. An area that is not finite, of more than
/// four million columns, or longer than that: nothing is said to be known. Cost O(columns).
AreaHeight highest_in(const Area& area, const HeldMap& held, double voxel_m);

}  // namespace crane::client
