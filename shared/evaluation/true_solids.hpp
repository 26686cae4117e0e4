// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "recording/truth.hpp"

namespace crane {

/// What really stands there, cell by cell of the true height map: how high, how far down the matter
/// is known to be solid, and which obstacle it belongs to.
struct TrueSolids {
  HeightMap heights;
  std::vector<TrueObstacle> obstacles;
  static constexpr int kNobody = -1;
  std::vector<std::int16_t> owner;  ///< by cell: index into obstacles

  /// The cell of a map point; -1 outside.
  [[nodiscard]] std::int64_t cell_at(double x_m, double y_m) const;
  /// The matter under a cell's surface is solid down to here. Known of boxes, cylinders and wedges;
  /// of all else (and of those hanging from who knows where) only the surface itself is.
  [[nodiscard]] double bottom_m(std::size_t cell) const;
};

/// Assigns each cell to the obstacle whose footprint and heights it fits.
TrueSolids make_solids(HeightMap heights, std::vector<TrueObstacle> obstacles);

/// Reads height_map.png and, if it is there, obstacles.yaml of a recording's truth folder.
/// Error: BadData or Configuration.
Result<TrueSolids> read_truth(const std::string& folder);

}  // namespace crane
