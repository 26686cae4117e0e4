// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cloud/point_cloud.hpp"

namespace crane {

/// Edge of the cells that voxels of this size in the image need [px].
constexpr int free_cell_px(double voxel_px) {
  return voxel_px >= 64 ? 32 : voxel_px < 4 ? 1 : static_cast<int>(voxel_px / 2);
}

/// Up to which depth the rays of one frame are known to pass free: the depth image in cells, each
/// the nearest plausible depth (two sigma nearer than measured) of its pixels and those of the
/// cells around. 0 where nothing is known to be free: where too few pixels have a match that proves
/// something, and around any cell in which some have none at all. Something thin may be there.
/// On several levels, each with cells of twice the edge: the nearer to the camera, the more of the
/// image a voxel covers, and all of that has to be free.
class FreeDepth {
 public:
  static constexpr int kLevels = 4;

  /// Cost O(pixels). Keeps its memory between frames.
  void build(const DepthFrame& frame, int cell_px);

  struct Range {
    float low = 0, high = 0;
    bool blind = false;  ///< any cell is; see blind()
  };
  /// Whether any part of a rectangle [cells of level 0] lies in the image.
  [[nodiscard]] bool touches(float u0, float v0, float u1, float v1) const {
    return u1 >= 0 && v1 >= 0 && u0 < float(columns()) && v0 < float(rows());
  }
  /// Bounds of all cells of level 0 that the rectangle touches; `low` is 0 if any part lies outside
  /// the image.
  [[nodiscard]] Range range(float u0, float v0, float u1, float v1) const;

  /// rows(level) x columns(level).
  [[nodiscard]] const float* cells(int level = 0) const { return levels_[at(level)].cells.data(); }
  [[nodiscard]] int columns(int level = 0) const { return levels_[at(level)].columns; }
  [[nodiscard]] int rows(int level = 0) const { return levels_[at(level)].rows; }
  [[nodiscard]] int cell_px(int level = 0) const { return cell_px_ << level; }
  [[nodiscard]] float farthest_m() const { return farthest_m_; }
  /// Infinite in patches of the image that have no match although both cameras see them, else 0;
  /// rows() x columns().
  [[nodiscard]] const float* blind() const { return blind_.data(); }

 private:
  struct Level {
    int columns = 0, rows = 0;
    std::vector<float> nearest;  ///< plausible depth of the matched pixels; infinite = none
    std::vector<std::uint16_t> proven,
        any;  ///< pixels with a match that proves something, with any
    std::vector<float> cells;
  };
  static constexpr std::size_t at(int level) { return static_cast<std::size_t>(level); }
  void look_at_pixels(const DepthFrame& frame);
  static void combine(const Level& fine, Level& coarse);
  void finish(Level& level, int cell_px);
  void find_blind();
  void find_bounds();

  static constexpr int kCoarse = 8;  ///< cells along one of coarse_
  int cell_px_ = 1, coarse_columns_ = 0;
  float farthest_m_ = 0;
  std::array<Level, kLevels> levels_;
  std::vector<float> own_, row_low_, blind_;
  std::vector<Range> coarse_;
};

}  // namespace crane
