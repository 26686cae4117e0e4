// SPDX-License-Identifier: Apache-2.0
#include "map_codec/octomap_points.hpp"

#include <algorithm>
#include <cmath>

namespace crane {

PointCloud occupied_points(const OctomapFile& map) {
  PointCloud out;
  for (const MapCube& c : map.occupied) {
    const int n = std::max(1, int(std::lround(c.size_m / map.voxel_m)));
    const auto at = [&](double middle, int i) {
      return float(middle + (i + 0.5) * map.voxel_m - c.size_m / 2);
    };
    for (int x = 0; x < n; ++x)
      for (int y = 0; y < n; ++y)
        for (int z = 0; z < n; ++z) out.push_back({at(c.x_m, x), at(c.y_m, y), at(c.z_m, z)});
  }
  return out;
}

}  // namespace crane
