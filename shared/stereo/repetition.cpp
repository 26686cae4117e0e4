#include "stereo/repetition.hpp"

#include <algorithm>
#include <cstdlib>

#include "base/expects.hpp"
#include "base/two_threads.hpp"
#include "stereo/repetition_cells.hpp"

namespace crane {
namespace {

/// Beside a repeating cell, one with fewer matches than this holds only the border of the pattern.
constexpr double kMatchedBeside = 0.8;

}  // namespace

Repetition::Repetition(int width, int height, int reach_px, int last_px)
    : width_(width),
      height_(height),
      columns_(width / kRepetitionCell),
      rows_(height / kRepetitionCell),
      reach_px_(reach_px),
      last_px_(last_px),
      repeats_(std::size_t(columns_) * std::size_t(rows_)) {}

bool Repetition::repeats_beside(int row, int column) const {
  for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r)
    for (int c = std::max(0, column - 1); c <= std::min(columns_ - 1, column + 1); ++c)
      if (repeats_[std::size_t(r * columns_ + c)] != 0) return true;
  return false;
}

std::uint32_t Repetition::drop_ambiguous(const GreyView& left, std::span<std::int16_t> disparity,
                                         std::span<std::uint8_t> confidence) {
  expects(left.width == width_ && left.height == height_ &&
              disparity.size() == std::size_t(width_) * std::size_t(height_) &&
              confidence.size() == disparity.size(),
          "images have the size that was announced");
  const RepetitionInput in{left.pixels, left.stride, width_, height_, reach_px_};
  on_two_threads([&](Meeting&) { find_repetition(in, 0, rows_ / 2, repeats_.data()); },
                 [&](Meeting&) { find_repetition(in, rows_ / 2, rows_, repeats_.data()); });
  if (std::none_of(repeats_.begin(), repeats_.end(), [](auto r) { return r != 0; })) return 0;
  std::uint32_t dropped = 0;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      if (!repeats_beside(row, column)) continue;
      // The last cells take what is left of the image.
      const int x1 = column + 1 == columns_ ? width_ : (column + 1) * kRepetitionCell;
      const int y1 = row + 1 == rows_ ? height_ : (row + 1) * kRepetitionCell;
      const auto each = [&](auto fn) {
        for (int y = row * kRepetitionCell; y < y1; ++y)
          for (int x = column * kRepetitionCell; x < x1; ++x)
            fn(std::size_t(y) * std::size_t(width_) + std::size_t(x));
      };
      std::uint32_t pixels = 0, matched = 0;
      each([&](std::size_t i) {
        ++pixels;
        matched += disparity[i] > 0 ? 1 : 0;
      });
      const bool all =
          repeats_[std::size_t(row * columns_ + column)] != 0 || matched < kMatchedBeside * pixels;
      each([&](std::size_t i) {
        const bool near = disparity[i] >= (last_px_ + 1) * kDisparityScale;
        if (disparity[i] == 0 || (!all && !near)) return;
        disparity[i] = 0;
        confidence[i] = 0;
        ++dropped;
      });
    }
  return dropped;
}

}  // namespace crane
