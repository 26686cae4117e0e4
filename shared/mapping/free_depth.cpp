// SPDX-License-Identifier: Apache-2.0
#include "mapping/free_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crane {
namespace {

/// Share of a cell's pixels that must prove something before its rays clear anything.
constexpr double kMinProven = 0.5;
/// And that must have a match at all: where there is none, anything thin may be.
constexpr double kMinMatched = 0.92;
constexpr float kNone = std::numeric_limits<float>::infinity();
/// A cell with too few matches: nothing is known to be free there, nor in the cells around.
constexpr float kVeto = -1;
/// Rows and columns of cells at the border of the image of which so many have no match: only one
/// camera sees them.
constexpr double kBare = 0.9;

}  // namespace

void FreeDepth::build(const DepthFrame& f, int cell_px) {
  cell_px_ = cell_px;
  look_at_pixels(f);
  for (int level = 1; level < kLevels; ++level) combine(levels_[at(level - 1)], levels_[at(level)]);
  for (int level = 0; level < kLevels; ++level) finish(levels_[at(level)], cell_px << level);
  find_blind();
  find_bounds();
}

void FreeDepth::look_at_pixels(const DepthFrame& f) {
  Level& cells = levels_[0];
  cells.columns = static_cast<int>(f.width) / cell_px_;
  cells.rows = static_cast<int>(f.height) / cell_px_;
  const std::size_t count = std::size_t(cells.columns) * cells.rows;
  cells.nearest.resize(count);
  cells.proven.resize(count);
  cells.any.resize(count);
  farthest_m_ = 0;
  const auto two_sigma =
      static_cast<float>(2 * 255 * f.sigma_disparity_px / (f.f_px * f.baseline_m));
  // Of a row of cells, pixel by pixel.
  std::vector<float> low(std::size_t(cells.columns) * cell_px_);
  std::vector<std::int32_t> proven(low.size()), any(low.size());
  for (int row = 0; row < cells.rows; ++row) {
    std::fill(low.begin(), low.end(), kNone);
    std::fill(proven.begin(), proven.end(), 0);
    std::fill(any.begin(), any.end(), 0);
    for (int dy = 0; dy < cell_px_; ++dy) {
      const std::size_t from = (std::size_t(row) * cell_px_ + dy) * f.width;
      const float* depth = f.depth_m + from;
      const std::uint8_t* confidence = f.confidence + from;
      for (std::size_t x = 0; x < low.size(); ++x) {
        const float z = depth[x];
        const float plausible = z - two_sigma * z * z / float(confidence[x] | 1);
        low[x] = std::min(low[x], z > 0 ? plausible : kNone);
        proven[x] += z > 0 ? 1 : 0;
        any[x] += z != 0 ? 1 : 0;
      }
      for (std::size_t x = 0; x < low.size(); x += 16)
        farthest_m_ = std::max(farthest_m_, depth[x]);
    }
    const std::size_t to = std::size_t(row) * cells.columns;
    for (std::size_t column = 0; column < std::size_t(cells.columns); ++column) {
      float lowest = kNone;
      int with_proof = 0, with_any = 0;
      for (std::size_t x = column * cell_px_; x < (column + 1) * cell_px_; ++x) {
        lowest = std::min(lowest, low[x]);
        with_proof += proven[x];
        with_any += any[x];
      }
      cells.nearest[to + column] = lowest;
      cells.proven[to + column] = static_cast<std::uint16_t>(with_proof);
      cells.any[to + column] = static_cast<std::uint16_t>(with_any);
    }
  }
}

void FreeDepth::combine(const Level& fine, Level& coarse) {
  coarse.columns = fine.columns / 2;
  coarse.rows = fine.rows / 2;
  const std::size_t count = std::size_t(coarse.columns) * coarse.rows;
  coarse.nearest.resize(count);
  coarse.proven.resize(count);
  coarse.any.resize(count);
  const auto width = static_cast<std::size_t>(fine.columns);
  for (std::size_t row = 0; row < std::size_t(coarse.rows); ++row)
    for (std::size_t column = 0; column < std::size_t(coarse.columns); ++column) {
      const std::size_t a = 2 * row * width + 2 * column;
      const std::size_t b = a + width;
      const std::size_t to = row * std::size_t(coarse.columns) + column;
      const auto sum = [&](const std::vector<std::uint16_t>& of) {
        return static_cast<std::uint16_t>(of[a] + of[a + 1] + of[b] + of[b + 1]);
      };
      coarse.nearest[to] = std::min(std::min(fine.nearest[a], fine.nearest[a + 1]),
                                    std::min(fine.nearest[b], fine.nearest[b + 1]));
      coarse.proven[to] = sum(fine.proven);
      coarse.any[to] = sum(fine.any);
    }
}

/// A voxel covers more than one cell: the nearest of 3 x 3.
void FreeDepth::finish(Level& level, int cell_px) {
  const auto width = static_cast<std::size_t>(level.columns);
  const auto height = static_cast<std::size_t>(level.rows);
  level.cells.resize(width * height);
  if (width == 0 || height == 0) return;
  own_.resize(width * height);
  row_low_.resize(width * height);
  const double pixels = double(cell_px) * cell_px;
  const int least_proven = std::max(1, static_cast<int>(kMinProven * pixels));
  const int least_any = static_cast<int>(std::ceil(kMinMatched * pixels));
  for (std::size_t i = 0; i < own_.size(); ++i) {
    const bool proven = level.proven[i] >= least_proven && level.nearest[i] > 0;
    own_[i] = level.any[i] < least_any ? kVeto : proven ? level.nearest[i] : kNone;
  }
  for (std::size_t row = 0; row < height; ++row) {
    const float* from = own_.data() + row * width;
    float* to = row_low_.data() + row * width;
    for (std::size_t c = 1; c + 1 < width; ++c)
      to[c] = std::min(std::min(from[c - 1], from[c]), from[c + 1]);
    to[0] = std::min(from[0], from[std::min<std::size_t>(1, width - 1)]);
    to[width - 1] = std::min(from[width - 1], from[width > 1 ? width - 2 : 0]);
  }
  for (std::size_t row = 0; row < height; ++row) {
    const float* own = own_.data() + row * width;
    const float* here = row_low_.data() + row * width;
    const float* above = row > 0 ? here - width : here;
    const float* below = row + 1 < height ? here + width : here;
    float* to = level.cells.data() + row * width;
    for (std::size_t c = 0; c < width; ++c) {
      const float nearest = std::min(std::min(above[c], here[c]), below[c]);
      to[c] = own[c] < kNone ? std::max(nearest, 0.0F) : 0;
    }
  }
}

void FreeDepth::find_blind() {
  const auto width = static_cast<std::size_t>(columns());
  const auto height = static_cast<std::size_t>(rows());
  const int half = cell_px_ * cell_px_ / 2;
  std::vector<std::uint8_t> empty(width * height);
  std::vector<std::uint32_t> in_column(width), in_row(height);
  for (std::size_t r = 0; r < height; ++r)
    for (std::size_t c = 0; c < width; ++c) {
      const std::size_t i = r * width + c;
      empty[i] = levels_[0].any[i] < std::max(1, half) ? 1 : 0;
      in_row[r] += empty[i];
      in_column[c] += empty[i];
    }
  const auto bare = [](std::uint32_t n, std::size_t of) { return n > kBare * double(of); };
  std::size_t c0 = 0, c1 = width, r0 = 0, r1 = height;
  while (c0 < c1 && bare(in_column[c0], height)) ++c0;
  while (c1 > c0 && bare(in_column[c1 - 1], height)) --c1;
  while (r0 < r1 && bare(in_row[r0], width)) ++r0;
  while (r1 > r0 && bare(in_row[r1 - 1], width)) --r1;
  blind_.assign(width * height, 0);
  // Patches of 3 x 3 cells, with their rim: what is smaller is noise.
  for (std::size_t r = r0 + 1; r + 1 < r1; ++r)
    for (std::size_t c = c0 + 1; c + 1 < c1; ++c) {
      const std::uint8_t* here = empty.data() + r * width + c;
      const auto three = [](const std::uint8_t* p) { return p[-1] & p[0] & p[1]; };
      if ((three(here - width) & three(here) & three(here + width)) == 0) continue;
      const std::size_t left = std::max(c, c0 + 2) - 2;
      const std::size_t right = std::min(c + 3, c1);
      for (std::size_t k = std::max(r, r0 + 2) - 2; k < std::min(r + 3, r1); ++k)
        std::fill(blind_.begin() + std::ptrdiff_t(k * width + left),
                  blind_.begin() + std::ptrdiff_t(k * width + right), kNone);
    }
}

void FreeDepth::find_bounds() {
  const int width = columns();
  coarse_columns_ = (width + kCoarse - 1) / kCoarse;
  coarse_.assign(std::size_t(coarse_columns_) * std::size_t((rows() + kCoarse - 1) / kCoarse),
                 {kNone, 0, false});
  for (int row = 0; row < rows(); ++row) {
    Range* coarse = coarse_.data() + std::size_t(row / kCoarse) * coarse_columns_;
    const std::size_t from = std::size_t(row) * width;
    for (int c = 0; c < width; ++c) {
      const float cell = levels_[0].cells[from + std::size_t(c)];
      Range& range = coarse[c / kCoarse];
      range.low = std::min(range.low, cell);
      range.high = std::max(range.high, cell);
      range.blind |= blind_[from + std::size_t(c)] != 0;
    }
  }
}

FreeDepth::Range FreeDepth::range(float u0, float v0, float u1, float v1) const {
  const Level& level = levels_[0];
  Range out{kNone, 0, false};
  if (u0 < 0 || v0 < 0 || u1 >= float(level.columns) || v1 >= float(level.rows)) out.low = 0;
  const int c0 = std::clamp(static_cast<int>(std::floor(u0)), 0, level.columns - 1);
  const int c1 = std::clamp(static_cast<int>(std::floor(u1)), 0, level.columns - 1);
  const int r0 = std::clamp(static_cast<int>(std::floor(v0)), 0, level.rows - 1);
  const int r1 = std::clamp(static_cast<int>(std::floor(v1)), 0, level.rows - 1);
  const bool few = (c1 - c0) * (r1 - r0) <= kCoarse * kCoarse;
  const int scale = few ? 1 : kCoarse;
  for (int r = r0 / scale; r <= r1 / scale; ++r)
    for (int c = c0 / scale; c <= c1 / scale; ++c) {
      const std::size_t i = std::size_t(r) * level.columns + std::size_t(c);
      const Range cell = few ? Range{level.cells[i], level.cells[i], blind_[i] != 0}
                             : coarse_[std::size_t(r) * coarse_columns_ + std::size_t(c)];
      out.low = std::min(out.low, cell.low);
      out.high = std::max(out.high, cell.high);
      out.blind |= cell.blind;
    }
  return out;
}

}  // namespace crane
