// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "crane/client/map.hpp"
#include "recording/truth.hpp"

namespace crane {

/// Measured against true, as in Tables 3 and 4 of Zhao et al. 2021.
struct ObstacleHeight {
  std::string name;
  double x_m = 0, y_m = 0;
  double true_m = 0, measured_m = 0;  ///< measured: median of the inner 70 % of the footprint
  double level_m = 0;                 ///< radius over which the top is level; 0 = none is
  std::size_t columns = 0;            ///< map columns it was measured from; 0 = nothing mapped
  /// The map says of hardly any of these columns that it ends there: all may be higher, as floor
  /// is that is seen below a seat whose top no image shows.
  bool lower_bound = false;
  [[nodiscard]] bool level() const { return level_m > 0; }
  [[nodiscard]] double error_percent() const {
    return 100 * (measured_m > true_m ? measured_m - true_m : true_m - measured_m) / true_m;
  }
};

std::vector<ObstacleHeight> measure(const client::HeightGrid& grid,
                                    const std::vector<TrueObstacle>& obstacles);

/// Height grid as 16-bit millimetres; below the floor counts as 0.
HeightMap to_height_map(const client::HeightGrid& grid);

}  // namespace crane
