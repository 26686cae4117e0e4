// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
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
  std::vector<std::uint16_t> height_mm;  ///< above `offset_m`; row by row
  double offset_m = 0;  ///< height of value 0: below the floor where there are pits

  [[nodiscard]] bool seen(std::size_t cell) const { return height_mm[cell] != kNeverSeen; }
  [[nodiscard]] double height_m(std::size_t cell) const {
    return height_mm[cell] * 1e-3 + offset_m;
  }
  [[nodiscard]] double x_m(std::size_t cell) const {  ///< of its middle
    return origin_x_m + (double(cell % columns) + 0.5) * cell_m;
  }
  [[nodiscard]] double y_m(std::size_t cell) const {
    const std::size_t row = cell / columns;
    return origin_y_m + (double(row) + 0.5) * cell_m;
  }
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
  /// Height of its lower side; NaN: the file does not say (those of before did not).
  double base_m = std::numeric_limits<double>::quiet_NaN();
  /// Of rods, cables and chains: both ends of the axis, and how far it hangs through.
  std::array<double, 3> from_m{}, to_m{};
  double sag_m = 0;
  double low_m = 0;  ///< wedges: height of the lower end, at local -x

  [[nodiscard]] bool is_line() const { return from_m != to_m; }
  /// Radius of a circle over which the top is level, to 2 % of the radius for a lying pipe; 0 =
  /// none is.
  [[nodiscard]] double level_radius_m() const {
    if (is_line() || kind == "wedge") return 0;
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
