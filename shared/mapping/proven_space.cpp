// SPDX-License-Identifier: Apache-2.0
#include "mapping/proven_space.hpp"

#include <algorithm>
#include <cmath>

namespace crane {

std::size_t prove_free(const UprightBox& box, double accuracy_m, OccupancyMap& map) {
  const Eigen::Vector3d half = box.half - Eigen::Vector3d::Constant(accuracy_m);
  if (!(half.minCoeff() > 0)) return 0;
  const double voxel = map.voxel_m();
  const double c = std::cos(box.yaw_rad);
  const double s = std::sin(box.yaw_rad);
  // A square of a voxel's size lies inside when its centre does, by so much.
  const double reach = voxel / 2 * (std::abs(c) + std::abs(s));
  const double radius = half.head<2>().norm();
  const int z0 = static_cast<int>(std::ceil((box.centre.z() - half.z()) / voxel));
  const int z1 = static_cast<int>(std::floor((box.centre.z() + half.z()) / voxel)) - 1;
  std::size_t proven = 0;
  for (int y = map.index(box.centre.y() - radius); y <= map.index(box.centre.y() + radius); ++y)
    for (int x = map.index(box.centre.x() - radius); x <= map.index(box.centre.x() + radius); ++x) {
      const double dx = map.centre(x) - box.centre.x();
      const double dy = map.centre(y) - box.centre.y();
      if (std::abs(c * dx + s * dy) + reach > half.x() ||
          std::abs(c * dy - s * dx) + reach > half.y() || z0 > z1)
        continue;
      Tile* const made = map.tile_if_room({tile_of(x), tile_of(y)});
      if (made == nullptr) return proven;
      Tile& tile = *made;
      const auto column = static_cast<std::size_t>(in_tile(y) * kTileEdge + in_tile(x));
      for (int z = z0; z <= z1; ++z) {
        Block* block = map.block(tile, tile_of(z));
        if (block == nullptr) return proven;
        const std::size_t index = static_cast<std::size_t>(in_tile(z)) * kTileColumns + column;
        std::int8_t& log_odds = block->log_odds[index];
        tile.reclassified |= classify(log_odds) != Occupancy::kFree;
        log_odds = kLogOddsMin;
        block->seen[index] = map.epoch();
        ++proven;
      }
      std::int16_t& lowest = tile.columns[column].proven_z;
      if (z0 < lowest) {
        lowest = static_cast<std::int16_t>(z0);
        tile.moved = true;
      }
      map.mark_changed(tile);
    }
  return proven;
}

std::size_t prove_swept(const UprightBox& from, const UprightBox& to, double accuracy_m,
                        OccupancyMap& map) {
  const double turned = std::abs(to.yaw_rad - from.yaw_rad) * to.half.head<2>().norm();
  const double moved = (to.centre - from.centre).norm() + turned;
  const int steps = std::max(1, static_cast<int>(std::ceil(moved / map.voxel_m())));
  std::size_t proven = 0;
  for (int i = 1; i <= steps; ++i) {
    UprightBox box = to;
    const double share = double(i) / steps;
    box.centre = from.centre + share * (to.centre - from.centre);
    box.yaw_rad = from.yaw_rad + share * (to.yaw_rad - from.yaw_rad);
    proven += prove_free(box, accuracy_m, map);
  }
  return proven;
}

}  // namespace crane
