// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "geometry/row_error.hpp"
#include "stereo/semi_global.hpp"

namespace crane {

/// Why a pair of images tells nothing. Such a pair must not change a map.
enum class PairFlaw : std::uint8_t {
  kLeftBlack,
  kRightBlack,
  kLeftSaturated,
  kRightSaturated,
  kLeftFrozen,  ///< byte for byte the one before, although another frame
  kRightFrozen,
  kNoOverlap,   ///< hardly a pixel matches: swapped, covered, or not exposed together
  kTooDark,     ///< what matches could as well match elsewhere, as below (pair_contrast.hpp)
  kNoContrast,  ///< fog, dust, a lens out of focus, a floor without any mark
  kTooNoisy,
};

/// In a sentence, with what to do.
const char* advice(PairFlaw flaw);

/// Rows of the rectified images farther apart than this [px] match less, and wrong.
inline constexpr double kRowErrorLimit_px = 0.7;

/// Looks at rectified pairs before they are matched. One thread.
class PairCheck {
 public:
  /// `number`: of the frame; the same frame may come twice.
  std::optional<PairFlaw> look(const GreyView& left, const GreyView& right, std::int64_t number);

 private:
  std::int64_t number_ = -1;
  std::uint64_t left_sum_ = 0, right_sum_ = 0;
};

/// Epipolar error as a function over the image, fitted robustly to up to a thousand patches at
/// their disparities (1/32 px); no patches when too few have texture. A calibration that fits stays
/// below a few tenths everywhere. Cost: below a millisecond.
RowError row_error(const GreyView& left, const GreyView& right,
                   std::span<const std::int16_t> disparity);

/// The largest of it within an image of that size [px]; nothing when it was not measured.
std::optional<double> largest_px(const RowError& error, int width, int height);

}  // namespace crane
