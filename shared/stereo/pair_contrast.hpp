// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "stereo/pair_check.hpp"
#include "stereo/semi_global.hpp"

namespace crane {

/// What there is to match in a pair, seen at patches of 9 x 9 pixels on a grid.
struct PairContrast {
  int patches = 0;   ///< looked at
  int textured = 0;  ///< with more than the steps of a grey level in both images
  int matched = 0;   ///< with a disparity
  int distinct = 0;  ///< of these: that disparity explains the patch far better than its neighbours
  double mean = 0;   ///< brightness of the darker image, 0 .. 255
  double texture = 0;  ///< median standard deviation of brightness within a patch, of the flatter
};

/// A matcher carries disparities over what it cannot see, so that a pair too dark or too noisy to
/// tell an obstacle from the floor comes out as floor. What was really seen agrees with itself: at
/// its disparity a patch of the left image is that of the right one but for brightness, gain and
/// noise, a few pixels beside it is not.
/// `disparity` [1/32 px]; values below `first_valid`, which is positive: no match. Cost: about a
/// millisecond.
PairContrast look_at_contrast(const GreyView& left, const GreyView& right,
                              std::span<const std::int16_t> disparity, std::int16_t first_valid);

/// Whether the pair as a whole cannot be trusted, and why.
std::optional<PairFlaw> flaw_of(const PairContrast& contrast);

}  // namespace crane
