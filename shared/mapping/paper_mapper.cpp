// SPDX-License-Identifier: Apache-2.0
#include "mapping/paper_mapper.hpp"

#include "cloud/pcl_filters.hpp"

namespace crane {

Result<void> PaperMapper::add(const DepthFrame& frame, TimeNs time) {
  const PointCloud points = to_points(frame, settings_.max_depth_m);
  if (cloud_.size() + points.size() > settings_.max_points)
    return Error{
        ErrorCode::kResource, "method: paper",
        "the accumulated cloud would exceed " + std::to_string(settings_.max_points) + " points",
        "the paper's method keeps every point; use mapper.method: default"};
  cloud_.insert(cloud_.end(), points.begin(), points.end());
  last_ = time;
  return {};
}

Result<PaperReport> PaperMapper::build(OccupancyMap& map) const {
  PaperReport report;
  report.points = cloud_.size();
  filtered_ = cloud_;
  for (const bool outliers : {settings_.outliers_first, !settings_.outliers_first}) {
    const Stopwatch watch;
    auto result =
        outliers ? remove_outliers(filtered_, settings_.outlier_neighbours, settings_.outlier_std)
                 : voxel_grid(filtered_, settings_.leaf_m);
    if (!result) return result.error();
    filtered_ = std::move(*result);
    (outliers ? report.outliers_ms : report.grid_ms) = watch.ms();
    (outliers ? report.after_outliers : report.after_grid) = filtered_.size();
  }
  const Stopwatch watch;
  for (const Point& p : filtered_) {
    const int x = map.index(p.x);
    const int y = map.index(p.y);
    const int z = map.index(p.z);
    Tile* const made = map.tile_if_room({tile_of(x), tile_of(y)});
    Block* block = made != nullptr ? map.block(*made, tile_of(z)) : nullptr;
    if (block == nullptr) continue;
    Tile& tile = *made;
    const int column = in_tile(y) * kTileEdge + in_tile(x);
    const int index = in_tile(z) * kTileColumns + column;
    see_occupied(block->log_odds[static_cast<std::size_t>(index)], kHit);
    block->seen[static_cast<std::size_t>(index)] = map.epoch();
    map.observe_surface(*block, index, z, p.z, p.r, p.g, p.b);
    saw_surface(tile.columns[static_cast<std::size_t>(column)], z, last_);
    tile.reclassified = true;
    map.mark_changed(tile);
  }
  report.octree_ms = watch.ms();
  return report;
}

}  // namespace crane
