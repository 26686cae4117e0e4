#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stereo/semi_global.hpp"

namespace crane {

/// Takes back matches on patterns that repeat along the rows (gratings, tiles, checkers, stripes):
/// they fit at several disparities, and a smooth surface at a wrong one looks as good as the true
/// one. What little is left between repeating cells goes, too. Two threads.
class Repetition {
 public:
  /// `reach_px`: width of the search of the full images. `last_px`: its end; a match beyond it (see
  /// NearField) goes next to a pattern as well.
  Repetition(int width, int height, int reach_px, int last_px);

  /// disparity, confidence: height x width, in place. Returns the number of matches taken back.
  std::uint32_t drop_ambiguous(const GreyView& left, std::span<std::int16_t> disparity,
                               std::span<std::uint8_t> confidence);

 private:
  [[nodiscard]] bool repeats_beside(int row, int column) const;

  int width_, height_, columns_, rows_, reach_px_, last_px_;
  std::vector<std::uint8_t> repeats_;  ///< rows_ x columns_
};

}  // namespace crane
