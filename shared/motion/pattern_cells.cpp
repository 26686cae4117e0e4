// SPDX-License-Identifier: Apache-2.0
#include "motion/pattern_cells.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/threads.hpp"

namespace crane {
namespace {

/// Of the camera's height above z = 0.
constexpr double kNearest = 0.2, kFarthest = 1.15;
constexpr int kReach = 4;                   ///< cells to the ones between which another lies
constexpr double kOneDepth = 3;             ///< sigmas
constexpr std::size_t kFewest = kCellEdge;  ///< pixels of a cell that the pair matched

}  // namespace

std::optional<CellFit> PatternCells::at(int row, int column) const {
  if (fits_.empty() || row < 0 || column < 0 || row >= rows_ || column >= columns_)
    return std::nullopt;
  return fits_[std::size_t(row * columns_ + column)];
}

std::optional<CellFit> PatternCells::between(int row, int column) const {
  const auto along_row = between(row, column, 0, 1);
  return along_row ? along_row : between(row, column, 1, 0);
}

std::optional<CellFit> PatternCells::between(int row, int column, int down, int right) const {
  std::optional<CellFit> before, after;
  for (int i = 1; i <= kReach && !before; ++i) before = at(row - i * down, column - i * right);
  for (int i = 1; i <= kReach && !after; ++i) after = at(row + i * down, column + i * right);
  if (!before || !after ||
      std::abs(before->inverse_m - after->inverse_m) >
          kOneDepth * std::max(before->sigma, after->sigma))
    return std::nullopt;
  CellFit out = *before;
  out.inverse_m = 0.5 * (before->inverse_m + after->inverse_m);
  out.views &= after->views;
  out.count = __builtin_popcount(out.views);
  return out;
}

PatternReport PatternCells::look(const DepthFrame& f, const PlacedImage& image, const ViewSet& set,
                                 std::span<const float> ambiguous_m, std::size_t most) {
  PatternReport report;
  columns_ = int(f.width) / kCellEdge;
  rows_ = int(f.height) / kCellEdge;
  const int columns = columns_, rows = rows_;
  fits_.assign(std::size_t(columns) * std::size_t(rows), std::nullopt);
  // Of each cell that is looked at the median disparity.
  const double fb = f.f_px * f.baseline_m;
  std::vector<double> matched_px(fits_.size());
  std::vector<float> depths;
  int last = 0;
  for (int i = 0; i < rows; ++i) {
    const int row = (next_row_ + i) % rows;
    for (int column = 0; column < columns; ++column) {
      depths.clear();
      for (int y = row * kCellEdge; y < (row + 1) * kCellEdge; ++y)
        for (int x = column * kCellEdge; x < (column + 1) * kCellEdge; ++x)
          if (const std::size_t at = std::size_t(y) * f.width + std::size_t(x);
              f.depth_m[at] == 0 && ambiguous_m[at] > 0)
            depths.push_back(ambiguous_m[at]);
      if (depths.size() < kFewest) continue;
      if (report.cells >= most) {
        ++report.put_off;
        continue;
      }
      const auto middle = depths.begin() + std::ptrdiff_t(depths.size() / 2);
      std::nth_element(depths.begin(), middle, depths.end());
      matched_px[std::size_t(row * columns + column)] = fb / double(*middle);
      if (++report.cells == most) last = row;
    }
  }
  next_row_ = report.put_off > 0 ? last : 0;
  const double camera_m = std::abs(f.T_map_rectified.translation().z());
  const PatternRange range{fb / (kFarthest * camera_m), fb / (kNearest * camera_m), fb};
  std::atomic<int> next{0};
  on_threads(threads_, [&](int, Meeting&) {
    PatternDepth pattern(image, set, range);
    CellProof proof(image, set);
    for (int row = next++; row < rows; row = next++)
      for (int column = 0; column < columns; ++column) {
        const auto cell = std::size_t(row * columns + column);
        if (!(matched_px[cell] > 0)) continue;
        const int u0 = column * kCellEdge, v0 = row * kCellEdge;
        if (const auto told =
                pattern.choose(u0 + kCellEdge / 2, v0 + kCellEdge / 2, matched_px[cell]))
          fits_[cell] = proof.sharpen(u0, v0, told->inverse_m, told->sigma, told->views);
      }
  });
  report.told = std::size_t(
      std::count_if(fits_.begin(), fits_.end(), [](const auto& fit) { return fit.has_value(); }));
  return report;
}

}  // namespace crane
