#include "mapping/heights.hpp"

namespace crane {

std::array<ColumnHeight, kTileColumns> tile_heights(const OccupancyMap& map, const Tile& tile,
                                                    double tolerance_m) {
  std::array<ColumnHeight, kTileColumns> out;
  const double voxel = map.voxel_m();
  for (int column = 0; column < kTileColumns; ++column) {
    ColumnHeight& c = out[static_cast<std::size_t>(column)];
    c.last_observed = tile.last_observed[static_cast<std::size_t>(column)];
    int top = 0;
    bool have_top = false;
    double top_m = 0;
    // From above: the first occupied voxel, and the one below it if it holds the same surface.
    for (auto it = tile.blocks.rbegin(); it != tile.blocks.rend(); ++it) {
      const Block& block = *it->second;
      for (int z = kTileEdge - 1; z >= 0; --z) {
        const int voxel_z = it->first * kTileEdge + z;
        if (have_top && voxel_z < top - 1) break;
        const int index = z * kTileColumns + column;
        if (block.at(index) != Occupancy::kOccupied) continue;
        const double height = map.surface_height_m(block, index, voxel_z);
        if (!have_top) {
          have_top = true;
          top = voxel_z;
          top_m = height;
          c.height_m = height;
          c.spread_m = 0.5 * voxel;
        } else if (top_m - height < 0.75 * voxel) {
          c.height_m = 0.5 * (top_m + height);
          c.spread_m = 0.5 * (top_m - height);
        }
      }
      if (have_top && it->first * kTileEdge <= top - 1) break;
    }
    if (have_top)
      c.state = c.height_m <= tolerance_m ? ColumnState::kFloor : ColumnState::kObstacle;
  }
  return out;
}

}  // namespace crane
