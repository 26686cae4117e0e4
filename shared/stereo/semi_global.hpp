// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace crane {

/// Disparities of all matchers of this library: 16-bit integers of 1/32 px; values <= 0: no match.
inline constexpr int kDisparityScale = 32;

/// One grey image, rows from the top.
struct GreyView {
  const std::uint8_t* pixels = nullptr;
  int width = 0, height = 0;
  std::ptrdiff_t stride = 0;  ///< bytes from row to row
};

struct SemiGlobalSettings {
  int first_px = 0;
  int count_px = 64;  ///< rounded up to what the inner loops can do; see disparities()
  int row_step = 2;   ///< 2: every other row is matched, those between come from both neighbours
  int left_right_px = 1;  ///< allowed difference between the left and the right winner
  int uniqueness = 16;    ///< least margin of the winner over the second best, of 252
  int threads = 0;        ///< 0 = the machine's, at most 4; the result is the same for any number
};

struct SemiGlobalReport {
  std::uint32_t matched = 0;
  std::uint32_t at_near_end = 0;  ///< refused winners at the near end of the search: maybe nearer
};

/// Semi-global matching (Hirschmueller 2008) of a rectified pair on centre-symmetric census costs:
/// four paths, left-right check, sub-pixel. Some threads sweep down and some up; they meet in the
/// middle and go on over each other's sums. Memory: width * height * disparities / row_step bytes.
/// Use by one thread.
class SemiGlobalMatcher {
 public:
  static constexpr int kMinWidth = 64, kMinHeight = 32;  ///< of the images [px]

  /// The smallest number of disparities >= `wanted` that can be searched; at most 256.
  static int disparities(int wanted);

  SemiGlobalMatcher(int width, int height, const SemiGlobalSettings& settings);
  ~SemiGlobalMatcher();
  SemiGlobalMatcher(SemiGlobalMatcher&&) noexcept;

  /// Out: height x width each; disparity as above, confidence 0..255 (0 = no match).
  SemiGlobalReport match(const GreyView& left, const GreyView& right,
                         std::span<std::int16_t> disparity, std::span<std::uint8_t> confidence);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane
