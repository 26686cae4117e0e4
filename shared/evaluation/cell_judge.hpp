// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "evaluation/judged_map.hpp"
#include "evaluation/true_solids.hpp"

namespace crane {

/// What the map makes of one true surface cell, worst last.
enum class CellVerdict : std::uint8_t {
  kNoTruth,  ///< never seen from anywhere
  kFloor,    ///< floor or so low that no load is hurt, and something is mapped there
  kBare,     ///< the same, and nothing is mapped
  kFound,    ///< an occupied voxel within the tolerance of the true top, in 3x3 columns
  kUnknown,  ///< no such, and not said to be free either: harmless, unavailable
  kLow,      ///< no such, and the voxel at the true top is said to be free
  kHollow,   ///< a cube within the matter is wholly free
  kCleared,  ///< a cube just below the true top is wholly free: a load told "clear" would hit it
};

/// Cells of an obstacle, or of all: shares are of `solid`.
struct CellCounts {
  std::string name;
  std::size_t solid = 0;                        ///< cells higher than the tolerance
  std::size_t found = 0, unknown = 0, low = 0;  ///< these three are all of them
  std::size_t cleared = 0, hollow = 0;          ///< beside that
  [[nodiscard]] double share(std::size_t part) const {
    return solid == 0 ? 0 : double(part) / double(solid);
  }
};

struct CellJudgement {
  CellCounts all;
  std::vector<CellCounts> obstacles;  ///< in their order; last "others", if there are any
  /// Highest of the cleared cells [m] and where; spots that hang together.
  double worst_m = 0, worst_x_m = 0, worst_y_m = 0;
  std::size_t cleared_spots = 0;
  double cell_m = 0;
  std::vector<CellVerdict> verdicts;  ///< by cell of the true height map
  std::vector<std::uint8_t> phantom;  ///< by cell: mapped higher than anything true nearby
};

/// Judges every true surface cell, thin things included. Solid is what is higher than
/// max(5 cm, 1.5 voxels); the cube has an edge of max(10 cm, 2 voxels) and stands on the cell's
/// middle, its upper side at the true top.
CellJudgement judge_cells(const JudgedMap& map, const TrueSolids& truth);

}  // namespace crane
