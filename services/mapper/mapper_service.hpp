// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

/// Service `cranemap-mapper`: partial_cloud and rangefinder_position in; map_tile, height_tile,
/// octree_map and map_status out.
int run_mapper(int argc, char** argv);

}  // namespace crane
