#pragma once

#include <cstdint>

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
};

struct IntegrationReport {
  SurfaceReport surfaces;
  std::uint64_t occupied = 0;  ///< voxels observed occupied
  std::uint64_t freed = 0;     ///< voxels observed free
};

/// One organised cloud into the map: occupied where surfaces are found, free where measured rays
/// pass, untouched behind the surface and where nothing matched. No ray casting: cubes of 8^3
/// voxels are projected into the depth image and freed or left at once, and voxel by voxel only
/// where a surface passes through them. Cost is that of what is seen, not of the map. Two threads:
/// one finds surfaces, one frees; the result does not depend on their timing.
class ProjectiveIntegrator {
 public:
  explicit ProjectiveIntegrator(const IntegratorSettings& settings) : settings_(settings) {}

  /// `time` is the exposure's.
  IntegrationReport integrate(const DepthFrame& frame, TimeNs time, OccupancyMap& map);

 private:
  /// How map points fall on the cells of FreeDepth.
  struct Projection {
    Eigen::Matrix3f R;  ///< rectified camera from map, per voxel
    Eigen::Vector3d t;  ///< position of map origin in the camera, [m]
    FreeProjection cells;
  };
  void carve(const DepthFrame& frame, OccupancyMap& map, IntegrationReport& report);
  void carve_block(Tile& tile, int block_z, OccupancyMap& map, IntegrationReport& report);
  [[nodiscard]] bool is_free(const Eigen::Vector3f& centre) const;
  void apply(const SurfaceHit& hit, TimeNs time, OccupancyMap& map, IntegrationReport& report);

  IntegratorSettings settings_;
  SurfaceFinder surfaces_;
  FreeDepth free_;
  Projection projection_;
};

}  // namespace crane
