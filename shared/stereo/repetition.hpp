// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stereo/semi_global.hpp"

namespace crane {

/// Takes back matches on patterns that repeat along the rows (gratings, tiles, checkers, stripes):
/// they fit at several disparities, and a smooth surface at a wrong one looks as good as the true
/// one. What is left of the pattern around such places goes, too.
class Repetition {
 public:
  /// `reach_px`: width of the search of the full images. `last_px`: its end; a match beyond it (see
  /// NearField) goes next to a pattern as well.
  /// `threads`: 0 = the machine's, at most 4; the result is the same for any number.
  Repetition(int width, int height, int reach_px, int last_px, int threads = 0);

  /// disparity, confidence: height x width, in place. Returns the number of matches taken back.
  std::uint32_t drop_ambiguous(const GreyView& left, std::span<std::int16_t> disparity,
                               std::span<std::uint8_t> confidence);

 private:
  /// One line of a cell.
  [[nodiscard]] std::span<std::int16_t> row_of_cell(std::span<std::int16_t> disparity, int row,
                                                    int column, int line) const;
  [[nodiscard]] int lines(int row) const;
  /// Whether a cell and those around it repeat.
  [[nodiscard]] bool inside(int row, int column) const;
  /// The median disparity of each cell inside a pattern.
  void find_levels(std::span<std::int16_t> disparity);
  /// Whether any cell right beside repeats, and the medians of those inside a pattern around.
  bool look_around(int row, int column, std::vector<std::int16_t>& levels) const;

  int width_, height_, columns_, rows_, reach_px_, last_px_, threads_;
  std::vector<std::uint8_t> repeats_;  ///< rows_ x columns_
  std::vector<std::int16_t> levels_, matches_;
};

}  // namespace crane
