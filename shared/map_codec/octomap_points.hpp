// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cloud/point_cloud.hpp"
#include "map_codec/octomap_file.hpp"

namespace crane {

/// Middles of the occupied voxels [m, map], black; larger cubes in voxels.
PointCloud occupied_points(const OctomapFile& map);

}  // namespace crane
