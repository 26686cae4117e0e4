#include "mapping/free_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crane {
namespace {

/// Share of a cell's pixels that must have a match before its rays clear anything.
constexpr double kMinMatchedShare = 0.5;
constexpr float kNone = std::numeric_limits<float>::infinity();

}  // namespace

void FreeDepth::build(const DepthFrame& f, int cell_px) {
  cell_px_ = cell_px;
  columns_ = static_cast<int>(f.width) / cell_px;
  rows_ = static_cast<int>(f.height) / cell_px;
  const std::size_t cells = std::size_t(columns_) * rows_;
  nearest_.assign(cells, kNone);
  row_low_.resize(cells);
  cells_.resize(cells);
  farthest_m_ = 0;
  const auto two_sigma =
      static_cast<float>(2 * 255 * f.sigma_disparity_px / (f.f_px * f.baseline_m));
  const int wanted = std::max(1, static_cast<int>(kMinMatchedShare * cell_px * cell_px));
  std::vector<float> low(std::size_t(columns_) * cell_px);  // of a row of cells, pixel by pixel
  std::vector<std::int32_t> matched(low.size());
  for (int row = 0; row < rows_; ++row) {
    std::fill(low.begin(), low.end(), kNone);
    std::fill(matched.begin(), matched.end(), 0);
    for (int dy = 0; dy < cell_px; ++dy) {
      const std::size_t at = (std::size_t(row) * cell_px + dy) * f.width;
      const float* depth = f.depth_m + at;
      const std::uint8_t* confidence = f.confidence + at;
      for (std::size_t x = 0; x < low.size(); ++x) {
        const float z = depth[x];
        const float plausible = z - two_sigma * z * z / float(confidence[x] | 1);
        low[x] = std::min(low[x], z > 0 ? plausible : kNone);
        matched[x] += z > 0 ? 1 : 0;
      }
      for (std::size_t x = 0; x < low.size(); x += 16)
        farthest_m_ = std::max(farthest_m_, depth[x]);
    }
    float* to = nearest_.data() + std::size_t(row) * columns_;
    for (int column = 0; column < columns_; ++column) {
      float lowest = kNone;
      int count = 0;
      for (int dx = 0; dx < cell_px; ++dx) {
        lowest = std::min(lowest, low[std::size_t(column) * cell_px + dx]);
        count += matched[std::size_t(column) * cell_px + dx];
      }
      if (count >= wanted && lowest > 0) to[column] = lowest;
    }
  }
  // A voxel covers more than one cell: the nearest of 3 x 3. Cells without depth do not count.
  const auto width = static_cast<std::size_t>(columns_);
  for (std::size_t row = 0; row < static_cast<std::size_t>(rows_); ++row) {
    const float* from = nearest_.data() + row * width;
    float* to = row_low_.data() + row * width;
    for (std::size_t c = 1; c + 1 < width; ++c)
      to[c] = std::min(std::min(from[c - 1], from[c]), from[c + 1]);
    to[0] = std::min(from[0], from[std::min<std::size_t>(1, width - 1)]);
    to[width - 1] = std::min(from[width - 1], from[width > 1 ? width - 2 : 0]);
  }
  coarse_columns_ = (columns_ + kCoarse - 1) / kCoarse;
  const int coarse_rows = (rows_ + kCoarse - 1) / kCoarse;
  coarse_.assign(std::size_t(coarse_columns_) * coarse_rows, {kNone, 0});
  for (int row = 0; row < rows_; ++row) {
    const std::size_t at = std::size_t(row) * width;
    const float* own = nearest_.data() + at;
    const float* here = row_low_.data() + at;
    const float* above = row > 0 ? here - width : here;
    const float* below = row + 1 < rows_ ? here + width : here;
    float* to = cells_.data() + at;
    for (std::size_t c = 0; c < width; ++c) {
      const float nearest = std::min(std::min(above[c], here[c]), below[c]);
      to[c] = own[c] < kNone ? nearest : 0;
    }
    Range* coarse = coarse_.data() + std::size_t(row / kCoarse) * coarse_columns_;
    for (std::size_t c = 0; c < width; ++c) {
      Range& range = coarse[c / kCoarse];
      range.low = std::min(range.low, to[c]);
      range.high = std::max(range.high, to[c]);
    }
  }
}

FreeDepth::Range FreeDepth::range(float u0, float v0, float u1, float v1) const {
  Range out{kNone, 0};
  if (u0 < 0 || v0 < 0 || u1 >= float(columns_) || v1 >= float(rows_)) out.low = 0;
  const int c0 = std::clamp(static_cast<int>(std::floor(u0)), 0, columns_ - 1);
  const int c1 = std::clamp(static_cast<int>(std::floor(u1)), 0, columns_ - 1);
  const int r0 = std::clamp(static_cast<int>(std::floor(v0)), 0, rows_ - 1);
  const int r1 = std::clamp(static_cast<int>(std::floor(v1)), 0, rows_ - 1);
  const bool few = (c1 - c0) * (r1 - r0) <= kCoarse * kCoarse;
  const int scale = few ? 1 : kCoarse;
  for (int r = r0 / scale; r <= r1 / scale; ++r)
    for (int c = c0 / scale; c <= c1 / scale; ++c) {
      const Range cell =
          few ? Range{cells_[std::size_t(r) * columns_ + c], cells_[std::size_t(r) * columns_ + c]}
              : coarse_[std::size_t(r) * coarse_columns_ + c];
      out.low = std::min(out.low, cell.low);
      out.high = std::max(out.high, cell.high);
    }
  return out;
}

}  // namespace crane
