#pragma once

#include <cstdint>
#include <vector>

#include "mapping/hit_table.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

/// Heights outside [z_min_m, z_max_m] are not mapped.
struct IntegratorSettings {
  double z_min_m = -0.3, z_max_m = 2;
};

struct IntegrationReport {
  std::uint64_t points = 0;        ///< depth samples used
  std::uint64_t occupied = 0;      ///< voxels observed occupied
  std::uint64_t weak = 0;          ///< voxels with too few points to be believed
  std::uint64_t freed = 0;         ///< voxels observed free
  std::uint64_t out_of_range = 0;  ///< points below z_min or above z_max
};

/// One organised cloud into the map: occupied where points lie, free where measured rays pass,
/// untouched behind the surface and where nothing matched. No ray casting: each voxel of the
/// frustum is projected once. Cost is that of what is seen, not of the map.
class ProjectiveIntegrator {
 public:
  explicit ProjectiveIntegrator(const IntegratorSettings& settings) : settings_(settings) {}

  /// `time` is the exposure's.
  IntegrationReport integrate(const DepthFrame& frame, TimeNs time, OccupancyMap& map);

 private:
  void gather_hits(const DepthFrame& frame, const OccupancyMap& map, IntegrationReport& report);
  void build_nearest(const DepthFrame& frame, int cell_px);
  void carve_free(const DepthFrame& frame, OccupancyMap& map, IntegrationReport& report);
  void carve_block(const DepthFrame& frame, Tile& tile, int block_z, OccupancyMap& map,
                   IntegrationReport& report);
  void apply_hits(TimeNs time, OccupancyMap& map, IntegrationReport& report);

  IntegratorSettings settings_;
  HitTable hits_;
  // The depth image in cells: what a ray through a cell is known to see free.
  int cell_px_ = 1, cells_x_ = 0, cells_y_ = 0;
  std::vector<float> nearest_, row_minimum_, free_depth_;
  float farthest_m_ = 0;
  double mean_depth_m_ = 0;
  int stride_px_ = 1;
  std::uint32_t min_points_ = 1;
};

}  // namespace crane
