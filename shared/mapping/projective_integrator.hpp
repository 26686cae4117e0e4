// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "mapping/free_cube.hpp"
#include "mapping/free_depth.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/surface_finder.hpp"

namespace crane {

/// Heights outside [z_min_m, z_max_m] are not mapped.
struct IntegratorSettings {
  double z_min_m = -0.3, z_max_m = 2;
  /// As OctoMap inserts a cloud: every sample is occupied, certain and in its own voxel, and space
  /// is free up to the measured depth. For comparison; the noise of the depths stays in the map.
  bool as_octomap = false;
  int threads = 0;  ///< 0 = the machine's, at most 4
};

struct IntegrationReport {
  SurfaceReport surfaces;
  std::uint64_t occupied = 0;  ///< voxels observed occupied
  std::uint64_t freed = 0;     ///< voxels observed free
};

/// One organised cloud into the map: occupied where surfaces are found, free where measured rays
/// pass, untouched behind the surface and where nothing matched. No ray casting: cubes of 8^3
/// voxels are projected into the depth image and freed or left at once, and voxel by voxel only
/// where a surface passes through them; those that are as free as can be are left out until the
/// next epoch. Cost is that of what is seen, not of the map. Surfaces are found while others free,
/// then all free, and all put surfaces in, each in tiles of its own; short of the map's memory
/// limit the result is the same for any number of threads.
class ProjectiveIntegrator {
 public:
  explicit ProjectiveIntegrator(const IntegratorSettings& settings) : settings_(settings) {}

  /// `time` is the exposure's.
  IntegrationReport integrate(const DepthFrame& frame, TimeNs time, OccupancyMap& map);

 private:
  /// How map points fall on the cells of FreeDepth.
  struct Projection {
    Eigen::Matrix3d R_exact;  ///< rectified camera from map, per voxel
    Eigen::Matrix3f R;        ///< the same
    Eigen::Vector3d t;        ///< position of map origin in the camera, [m]
    double height_m = 0;      ///< of the camera, map z
    std::array<FreeProjection, FreeDepth::kLevels> levels;
    float voxel_cells = 1;  ///< edge of a voxel at a depth of 1 m, in pairs of cells of level 0
  };
  /// The level of FreeDepth whose 3 x 3 cells cover a voxel at this depth [m].
  [[nodiscard]] const FreeProjection& level_at(float depth_m) const;
  /// Tiles and blocks that the frustum touches.
  struct Frustum {
    std::vector<Tile*> tiles;
    int block_low = 0, block_high = -1;
  };
  Frustum aim(const DepthFrame& frame, OccupancyMap& map);
  /// Frees tiles of the frustum until none is left; `next` is shared with another thread.
  std::uint64_t carve(const Frustum& frustum, std::atomic<std::size_t>& next, OccupancyMap& map);
  std::uint64_t carve_block(Tile& tile, int block_z, OccupancyMap& map);
  /// Free voxels of a cube that lie in blind patches become unknown.
  void forget_blind(Tile& tile, Block& block, const Eigen::Vector3f& corner, int x0, int y0,
                    int z0) const;
  /// Whether a voxel was seen through in this frame.
  [[nodiscard]] bool is_free(std::int32_t x, std::int32_t y, std::int32_t z) const;
  /// Returns the number of voxels observed occupied.
  std::uint64_t apply_all(const std::vector<SurfaceHit>& hits, TimeNs time, OccupancyMap& map);
  /// `highest`: of its column in this frame. False when there is no memory for it.
  bool apply(const SurfaceHit& hit, bool highest, TimeNs time, Tile& tile, OccupancyMap& map);

  IntegratorSettings settings_;
  SurfaceFinder surfaces_;
  FreeDepth free_;
  Projection projection_;
};

}  // namespace crane
