// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace crane {

/// Rows of two rectified images and of the disparities found in them.
struct SubpixelInput {
  const std::uint8_t* left = nullptr;
  const std::uint8_t* right = nullptr;
  std::ptrdiff_t left_stride = 0, right_stride = 0;  ///< from one row with disparities to the next
  const std::int16_t* disparity = nullptr;           ///< rows x width, 1/32 px; <= 0 = none
  int width = 0, rows = 0;
};

/// Refined disparities, rows x width each.
struct Subpixel {
  float* disparity = nullptr;   ///< [px]; kNoDisparity = none
  float* weight = nullptr;      ///< brightness gradient squared, summed over the window
  float* brightness = nullptr;  ///< of the left image, mean along the row [grey levels]
  float* limit = nullptr;       ///< by how much another row may differ on one surface, squared
};
inline constexpr float kNoDisparity = -1e4F;

/// Refines disparities from brightness: least squares of the brightness difference against the
/// gradient (Lucas and Kanade 1981, along the row) over 7 x 5 pixels of the same surface, with an
/// offset in brightness between the images. Unlike a curve through matching costs it has no liking
/// for whole pixels. Where there is no texture the disparity stays as it was.
/// Writes rows [from, to) of `out`. Compiled for several instruction sets, chosen at run time.
void refine_subpixel(const SubpixelInput& in, int from, int to, const Subpixel& out);

/// Standard deviation [px] of a disparity with confidence 255; with confidence c it is 255 / c
/// times that.
inline constexpr float kBestSigmaPx = 0.05F;

/// Pulls each disparity towards the mean of its surface around it (13 x 13 pixels, every third),
/// the more the less texture it has of its own, and drops what has no surface around it. Writes
/// rows [from, to): disparity in 1/32 px, 0 = none, and confidence.
void settle_subpixel(const Subpixel& in, int width, int rows, int from, int to,
                     std::int16_t* disparity, std::uint8_t* confidence);

}  // namespace crane
