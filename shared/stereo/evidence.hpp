// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/threads.hpp"
#include "stereo/semi_global.hpp"

namespace crane {

struct EvidenceReport {
  std::uint32_t unexplained = 0;  ///< matches that the right image does not bear out: dropped
  std::uint32_t borrowed = 0;     ///< matches that lie between two edges along the row: dropped
  std::uint32_t weak = 0;         ///< likely matches that prove nothing: negative now
};

/// Takes matches back that the images do not prove, pixel by pixel at full resolution. A matcher
/// decides for a window and a smooth surface: what is thin it gives the disparity of what lies
/// behind. A match proves something only if
/// - the right image, moved by the found disparities, is the left one along the row around the
///   pixel, up to noise and a difference in brightness; and
/// - the row has texture there, or the pixel joins one above or below that has, over no edge in
///   brightness. An edge along the baseline fits at every disparity: what lies between two such
///   edges (a pipe, a rail, a painted line) may be at any depth.
/// What is explained almost is kept as a likely surface: its disparity becomes negative.
/// Keeps its memory between frames.
class Evidence {
 public:
  /// `threads`: 0 = the machine's, at most 4; the result is the same for any number.
  explicit Evidence(int threads = 0) : threads_(threads_or_default(threads)) {}

  /// disparity, confidence: height x width, in place; disparity 0 = no match.
  EvidenceReport keep_proven(const GreyView& left, const GreyView& right,
                             std::span<std::int16_t> disparity, std::span<std::uint8_t> confidence);

 private:
  int threads_;
  std::vector<std::uint8_t> mean_, bits_;
  std::vector<float> residuals_;

  /// Variance of a pixel's brightness, from matches all over the image: most are right.
  float noise_of(const GreyView& left, const GreyView& right,
                 std::span<const std::int16_t> disparity);
};

}  // namespace crane
