// SPDX-License-Identifier: Apache-2.0
#include "stereo/repetition.hpp"

#include <algorithm>
#include <cstdlib>

#include "base/expects.hpp"
#include "base/threads.hpp"
#include "stereo/repetition_cells.hpp"

namespace crane {
namespace {

/// Cells at most so far from the inside of a pattern may hold more of it, too little to be seen as
/// one: matches at the pattern's disparity, up to this difference, are doubtful there; and right
/// beside it all, where fewer pixels than this match.
constexpr int kReach = 3, kSameLevel = 3 * kDisparityScale / 2;
constexpr double kMatchedBeside = 0.8;
constexpr std::size_t kFewest = 20;  ///< matches to know the pattern's disparity from

}  // namespace

Repetition::Repetition(int width, int height, int reach_px, int last_px, int threads)
    : width_(width),
      height_(height),
      columns_(width / kRepetitionCell),
      rows_(height / kRepetitionCell),
      reach_px_(reach_px),
      last_px_(last_px),
      threads_(threads_or_default(threads)),
      repeats_(std::size_t(columns_) * std::size_t(rows_)) {}

std::span<std::int16_t> Repetition::row_of_cell(std::span<std::int16_t> disparity, int row,
                                                int column, int line) const {
  // The last cells take what is left of the image.
  const int x1 = column + 1 == columns_ ? width_ : (column + 1) * kRepetitionCell;
  const int y = row * kRepetitionCell + line;
  const std::size_t from =
      std::size_t(y) * std::size_t(width_) + std::size_t(column) * kRepetitionCell;
  return disparity.subspan(from, std::size_t(x1 - column * kRepetitionCell));
}

int Repetition::lines(int row) const {
  return row + 1 == rows_ ? height_ - row * kRepetitionCell : kRepetitionCell;
}

void Repetition::find_levels(std::span<std::int16_t> disparity) {
  levels_.assign(repeats_.size(), 0);
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const std::size_t cell = std::size_t(row * columns_ + column);
      if (!inside(row, column)) continue;
      matches_.clear();
      for (int line = 0; line < lines(row); line += 2)
        for (const std::int16_t d : row_of_cell(disparity, row, column, line))
          if (d != 0) matches_.push_back(static_cast<std::int16_t>(std::abs(d)));
      if (matches_.size() < kFewest) continue;
      const auto middle = matches_.begin() + static_cast<std::ptrdiff_t>(matches_.size() / 2);
      std::nth_element(matches_.begin(), middle, matches_.end());
      levels_[cell] = *middle;
    }
}

bool Repetition::inside(int row, int column) const {
  if (row == 0 || column == 0 || row + 1 == rows_ || column + 1 == columns_)
    return repeats_[std::size_t(row * columns_ + column)] != 0;
  for (int r = row - 1; r <= row + 1; ++r)
    for (int c = column - 1; c <= column + 1; ++c)
      if (repeats_[std::size_t(r * columns_ + c)] == 0) return false;
  return true;
}

bool Repetition::look_around(int row, int column, std::vector<std::int16_t>& levels) const {
  levels.clear();
  bool beside = false;
  for (int r = std::max(0, row - kReach); r <= std::min(rows_ - 1, row + kReach); ++r)
    for (int c = std::max(0, column - kReach); c <= std::min(columns_ - 1, column + kReach); ++c) {
      const std::size_t cell = std::size_t(r * columns_ + c);
      beside |= repeats_[cell] != 0 && std::abs(r - row) <= 1 && std::abs(c - column) <= 1;
      if (levels_[cell] > 0) levels.push_back(levels_[cell]);
    }
  return beside;
}

std::uint32_t Repetition::drop_ambiguous(const GreyView& left, std::span<std::int16_t> disparity,
                                         std::span<std::uint8_t> confidence) {
  expects(left.width == width_ && left.height == height_ &&
              disparity.size() == std::size_t(width_) * std::size_t(height_) &&
              confidence.size() == disparity.size(),
          "images have the size that was announced");
  const RepetitionInput in{left.pixels, left.stride, width_, height_, reach_px_};
  on_threads(threads_, [&](int thread, Meeting&) {
    const auto [from, to] = share_of(rows_, thread, threads_);
    find_repetition(in, from, to, repeats_.data());
  });
  if (std::none_of(repeats_.begin(), repeats_.end(), [](auto r) { return r != 0; })) return 0;
  find_levels(disparity);
  std::uint32_t dropped = 0;
  std::vector<std::int16_t> levels;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const bool beside = look_around(row, column, levels);
      if (!beside && levels.empty()) continue;
      std::size_t pixels = 0, matched = 0;
      for (int line = 0; line < lines(row); ++line)
        for (const std::int16_t d : row_of_cell(disparity, row, column, line)) {
          ++pixels;
          matched += d > 0 ? 1 : 0;
        }
      const bool all = repeats_[std::size_t(row * columns_ + column)] != 0 ||
                       (beside && double(matched) < kMatchedBeside * double(pixels));
      const auto doubtful = [&](int d) {
        return all || (beside && d >= (last_px_ + 1) * kDisparityScale) ||
               std::any_of(levels.begin(), levels.end(),
                           [d](std::int16_t l) { return std::abs(d - l) <= kSameLevel; });
      };
      for (int line = 0; line < lines(row); ++line)
        for (std::int16_t& d : row_of_cell(disparity, row, column, line)) {
          if (d == 0 || !doubtful(std::abs(d))) continue;
          confidence[std::size_t(&d - disparity.data())] = 0;
          if (d < 0 || d >= (last_px_ + 1) * kDisparityScale) d = 0;
          ++dropped;
        }
    }
  return dropped;
}

}  // namespace crane
