#pragma once

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
/// cells around. 0 where too few pixels have a match: nothing is known to be free there.
class FreeDepth {
 public:
  /// Cost O(pixels). Keeps its memory between frames.
  void build(const DepthFrame& frame, int cell_px);

  /// Of the cell at image position (u, v) in cells; 0 outside the image.
  [[nodiscard]] float at(float u, float v) const {
    if (!(u >= 0 && v >= 0 && u < float(columns_) && v < float(rows_))) return 0;
    return cells_[std::size_t(int(v)) * columns_ + std::size_t(int(u))];
  }
  struct Range {
    float low = 0, high = 0;
  };
  /// Whether any part of a rectangle [cells] lies in the image.
  [[nodiscard]] bool touches(float u0, float v0, float u1, float v1) const {
    return u1 >= 0 && v1 >= 0 && u0 < float(columns_) && v0 < float(rows_);
  }
  /// Bounds of all cells that the rectangle touches; `low` is 0 if any part lies outside the image.
  [[nodiscard]] Range range(float u0, float v0, float u1, float v1) const;

  [[nodiscard]] const float* cells() const { return cells_.data(); }  ///< rows() x columns()
  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] float farthest_m() const { return farthest_m_; }
  [[nodiscard]] int cell_px() const { return cell_px_; }

 private:
  static constexpr int kCoarse = 8;  ///< cells along a coarse one
  int cell_px_ = 1, columns_ = 0, rows_ = 0, coarse_columns_ = 0;
  float farthest_m_ = 0;
  std::vector<float> nearest_, row_low_, cells_;
  std::vector<Range> coarse_;
};

}  // namespace crane
