// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "motion/views.hpp"

namespace crane {

struct BarReport {
  std::size_t bands = 0;    ///< looked at: pieces of rows without a match
  std::size_t put_off = 0;  ///< not looked at for lack of time
  std::size_t found = 0;    ///< pixels that got a likely depth
};

/// Pipes, rails and other bars along the baseline: the pair cannot tell their depth, since along
/// its rows they look alike everywhere. Earlier frames from beside can: a strip of a band without a
/// match is compared at all depths before what lies around it (plane sweep, Collins 1996). What a
/// bar's depth explains clearly better than any other, and in three pieces side by side alike, is
/// likely a surface there: a depth below 0, which frees nothing.
class Bars {
 public:
  explicit Bars(int threads) : threads_(threads) {}

  /// `depth_m`, `confidence`: those of `frame`; pixels of depth 0, and amid a bar those
  /// behind it, may get one. At most `most` bands; the rest in the next frames.
  BarReport look(const DepthFrame& frame, const PlacedImage& image, const ViewSet& set,
                 std::span<float> depth_m, std::span<std::uint8_t> confidence, std::size_t most);

 private:
  int threads_;
  int next_column_ = 0;
};

}  // namespace crane
