// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/bundle.hpp"

namespace crane {

/// Row differences of the same corner in the rectified pair [px], of each view's corners that both
/// cameras see.
std::vector<std::vector<double>> row_differences(const std::vector<View>& views,
                                                 const RigEstimate& rig);

/// The board seen by each camera alone: whether either camera's corners fit a board somewhere, and
/// how far apart [m] the two say its middle is. What does not fit one pose though each half does
/// was not taken at one time.
struct Apart {
  double left_px = 0, right_px = 0;  ///< root mean square of what each fit leaves
  double distance_m = 0;
};
Apart seen_apart(const View& view, const Board& board, const RigEstimate& rig);

}  // namespace crane
