#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// Heights on a regular grid of columns (x) and rows (y); row 0 has the lowest y.
struct HeightMap {
  double cell_m = 0;
  double origin_x_m = 0, origin_y_m = 0;  ///< corner of cell (0, 0)
  std::uint32_t columns = 0, rows = 0;
  static constexpr std::uint16_t kNeverSeen = 65'535;
  std::vector<std::uint16_t> height_mm;  ///< above the floor; row by row
};

/// Reads `path` (16-bit PNG, millimetres) with its geometry from the .yaml file beside it.
/// Error: BadData or Configuration.
Result<HeightMap> read_height_map(const std::string& png_path);
/// Error: Resource.
Result<void> write_height_map(const std::string& png_path, const HeightMap& map);

/// What really stood in a recording's scene (truth/obstacles.yaml).
struct TrueObstacle {
  std::string name, kind;
  double x_m = 0, y_m = 0;   ///< centre of the footprint
  double height_m = 0;       ///< highest point
  double seat_height_m = 0;  ///< of chairs: the surface that is measured; 0 = height_m
  double radius_m = 0;       ///< round footprints
  double size_x_m = 0, size_y_m = 0, yaw_rad = 0;  ///< rectangular ones
  double length_m = 0;                             ///< lying pipes

  /// Radius of a circle over which the top is level, to 2 % of the radius for a lying pipe.
  [[nodiscard]] double level_radius_m() const {
    if (length_m > 0) return 0.2 * radius_m;
    return radius_m > 0 ? radius_m : 0.5 * (size_x_m < size_y_m ? size_x_m : size_y_m);
  }
  [[nodiscard]] double measured_height_m() const {
    return seat_height_m > 0 ? seat_height_m : height_m;
  }
};
Result<std::vector<TrueObstacle>> read_obstacles(const std::string& path);
Result<void> write_obstacles(const std::string& path, const std::vector<TrueObstacle>& obstacles);

}  // namespace crane
