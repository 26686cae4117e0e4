// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "map_codec/octomap_file.hpp"
#include "recording/truth.hpp"

namespace crane {

/// Shares are of the columns named; heights in metres. See "Judging a map" in the README of
/// evaluation.
struct Judgement {
  double voxel_m = 0;
  std::size_t occupied = 0, columns = 0, obstacle_columns = 0;
  double coverage = 0;           ///< columns with anything mapped, of those with truth
  double unsafe = 0;             ///< obstacle columns mapped lower than true
  double missed = 0;             ///< obstacle columns mapped as floor
  double unmapped_obstacle = 0;  ///< obstacle columns with nothing near
  double phantom = 0;            ///< mapped columns higher than anything true nearby
  /// Of the worst phantom: how much higher [m], and where; 0 = none.
  double phantom_excess_m = 0, phantom_x_m = 0, phantom_y_m = 0;
  double error_median_m = 0, error_p95_m = 0;  ///< of level columns; -1 = none
};

/// Compares an occupancy map with the true heights, per column of the voxel size, with a tolerance
/// of 1.5 voxels + 2 % of the height and one column sideways.
Judgement judge(const std::vector<MapCube>& occupied, double voxel_m, const HeightMap& truth);

}  // namespace crane
