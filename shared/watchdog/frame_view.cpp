// SPDX-License-Identifier: Apache-2.0
#include "watchdog/frame_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace crane {
namespace {

constexpr int kColumns = 32;
constexpr int kSamples = 6;         ///< to each side of a block
constexpr std::size_t kLeast = 14;  ///< of its 36 samples must have a depth
constexpr std::uint8_t kConfident = 64;
/// Heights in a flat block differ by no more than this many standard deviations of one, and this
/// share of the distance.
constexpr double kFlatSigmas = 4, kFlatShare = 0.004;

float middle(std::array<float, std::size_t(kSamples) * kSamples>& values, std::size_t count) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(values.begin(), at, values.begin() + static_cast<std::ptrdiff_t>(count));
  return *at;
}

}  // namespace

const ViewCell* FrameView::showing(const Eigen::Vector3d& map_m) const {
  const Eigen::Vector3d p = T_rectified_map * map_m;
  if (p.z() <= 0) return nullptr;
  const double u = f_px * p.x() / p.z() + cx_px;
  const double v = f_px * p.y() / p.z() + cy_px;
  const int column = static_cast<int>(std::floor(u / edge_px));
  const int row = static_cast<int>(std::floor(v / edge_px));
  if (column < 0 || row < 0 || column >= columns || row >= rows) return nullptr;
  return &at(column, row);
}

void look_at(const DepthFrame& f, FrameView& view) {
  view.columns = kColumns;
  view.edge_px = double(f.width) / kColumns;
  view.rows = std::max(1, static_cast<int>(f.height / view.edge_px));
  view.f_px = f.f_px, view.cx_px = f.cx_px, view.cy_px = f.cy_px;
  view.T_map_rectified = f.T_map_rectified;
  view.T_rectified_map = f.T_map_rectified.inverse();
  view.cells.assign(std::size_t(view.columns) * std::size_t(view.rows), {});
  const Eigen::Matrix3d R = f.T_map_rectified.linear();
  const Eigen::Vector3d t = f.T_map_rectified.translation();
  const double step = view.edge_px / kSamples;
  for (int row = 0; row < view.rows; ++row)
    for (int column = 0; column < view.columns; ++column) {
      std::array<float, std::size_t(kSamples) * kSamples> heights{}, depths{};
      std::size_t n = 0;
      for (int j = 0; j < kSamples; ++j)
        for (int i = 0; i < kSamples; ++i) {
          const auto u = static_cast<std::size_t>(column * view.edge_px + (i + 0.5) * step);
          const auto v = static_cast<std::size_t>(row * view.edge_px + (j + 0.5) * step);
          const std::size_t at = v * f.width + u;
          const float z = f.depth_m[at];
          if (!(z > 0) || f.confidence[at] < kConfident) continue;
          const double x = (double(u) - f.cx_px) / f.f_px * z;
          const double y = (double(v) - f.cy_px) / f.f_px * z;
          heights[n] = static_cast<float>(R(2, 0) * x + R(2, 1) * y + R(2, 2) * z + t.z());
          depths[n++] = z;
        }
      if (n < kLeast) continue;
      ViewCell& cell = view.cells[static_cast<std::size_t>(row * view.columns + column)];
      const float height = middle(heights, n);
      const double depth = middle(depths, n);
      const double u = (column + 0.5) * view.edge_px - 0.5;
      const double v = (row + 0.5) * view.edge_px - 0.5;
      const Eigen::Vector3d p((u - f.cx_px) / f.f_px * depth, (v - f.cy_px) / f.f_px * depth,
                              depth);
      cell.map_m = (R * p + t).cast<float>();
      cell.map_m.z() = height;
      for (std::size_t i = 0; i < n; ++i) heights[i] = std::abs(heights[i] - height);
      cell.spread_m = 1.48F * middle(heights, n);
      const double sigma_m = depth * depth / (f.f_px * f.baseline_m) * f.sigma_disparity_px;
      cell.known = true;
      cell.flat = cell.spread_m < kFlatSigmas * sigma_m + kFlatShare * depth;
    }
}

}  // namespace crane
