// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "calibration/bundle.hpp"
#include "calibration/view.hpp"

namespace crane {

/// How well the views show what a calibration needs.
struct Coverage {
  static constexpr int kColumns = 4, kRows = 3;
  /// Corners in each part of the image, row by row; left camera, right camera.
  std::array<std::array<int, kColumns * kRows>, 2> corners{};
  /// How far the board's normal was turned from the view: about the image's x and y [rad], lowest
  /// and highest. 0 without poses.
  std::array<double, 2> tilt_x_rad{}, tilt_y_rad{};
  double largest = 0;  ///< share of the image's width that the board filled at most
};

/// `poses`: the board in the left camera, of each view; may be empty.
Coverage coverage_of(const std::vector<View>& views, const ImageSize& size,
                     const std::vector<Eigen::Isometry3d>& poses);

/// What the next views should show, the most wanted first; empty: nothing is missing.
std::vector<std::string> wanted(const Coverage& coverage);

}  // namespace crane
