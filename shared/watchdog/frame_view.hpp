// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cloud/point_cloud.hpp"

namespace crane {

/// One block of the image: the median of what was measured in it.
struct ViewCell {
  Eigen::Vector3f map_m = Eigen::Vector3f::Zero();
  float spread_m = 0;  ///< of heights in the block: 1.48 times their median deviation
  bool known = false;
  bool flat = false;  ///< no edge runs through it
};

/// What a placed frame shows, on a coarse grid of its image.
struct FrameView {
  int columns = 0, rows = 0;
  double edge_px = 0;  ///< of a block
  double f_px = 0, cx_px = 0, cy_px = 0;
  Eigen::Isometry3d T_map_rectified = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_rectified_map = Eigen::Isometry3d::Identity();
  std::vector<ViewCell> cells;

  [[nodiscard]] const ViewCell& at(int column, int row) const {
    return cells[static_cast<std::size_t>(row * columns + column)];
  }
  /// The block that shows a place of the map, or nullptr.
  [[nodiscard]] const ViewCell* showing(const Eigen::Vector3d& map_m) const;
};

/// `view` is overwritten: its memory is used again. Cost: some 20,000 pixels are looked at.
void look_at(const DepthFrame& frame, FrameView& view);

}  // namespace crane
