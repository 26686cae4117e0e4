#pragma once

#include <cstdint>
#include <optional>
#include <span>

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

/// Epipolar error: by how many rows [px] the right image lies lower than the left one, the median
/// of up to a thousand patches at their disparities (1/32 px); nothing when too few have texture.
/// A calibration that fits stays below a few tenths. Cost: below a millisecond.
std::optional<double> row_error_px(const GreyView& left, const GreyView& right,
                                   std::span<const std::int16_t> disparity);

}  // namespace crane
