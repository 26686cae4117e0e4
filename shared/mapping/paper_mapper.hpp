// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

/// Zhao et al. 2021, section 3.1: accumulate the registered clouds, remove outliers, voxel grid,
/// octree. Only occupied space is known; the whole is made anew each time.
struct PaperSettings {
  int outlier_neighbours = 50;  ///< 50, later 60
  double outlier_std = 1.0;     ///< 1.0, later 0.8
  double leaf_m = 0.01;         ///< voxel grid
  bool outliers_first =
      false;  ///< the paper names the filters in both orders; grid first is faster
  double max_depth_m = 60;
  std::size_t max_points = 100'000'000;
};

struct PaperReport {
  std::size_t points = 0, after_grid = 0, after_outliers = 0;
  double grid_ms = 0, outliers_ms = 0, octree_ms = 0;
};

/// Voxel edge by eq. 9: d_min = 0.1 D, D the distance from the camera to the obstacles.
constexpr double paper_voxel_m(double distance_m) {
  return 0.1 * distance_m;
}

class PaperMapper {
 public:
  explicit PaperMapper(const PaperSettings& settings) : settings_(settings) {}

  /// Registers one cloud (eq. 5-7) and keeps its points. Error: Resource at max_points.
  Result<void> add(const DepthFrame& frame, TimeNs time);
  /// Filters everything accumulated and writes it into `map`, which must be empty.
  Result<PaperReport> build(OccupancyMap& map) const;
  [[nodiscard]] std::size_t points() const { return cloud_.size(); }
  /// Filtered cloud of the last build(), for map.pcd.
  [[nodiscard]] const PointCloud& filtered() const { return filtered_; }

 private:
  PaperSettings settings_;
  PointCloud cloud_;
  mutable PointCloud filtered_;
  TimeNs last_ = 0;
};

}  // namespace crane
