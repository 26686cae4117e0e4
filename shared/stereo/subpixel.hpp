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

/// Refines disparities from brightness: least squares of the brightness difference against the
/// gradient (Lucas and Kanade 1981, along the row) over 5 x 5 pixels of the same surface, with an
/// offset in brightness between the images. Unlike a curve through matching costs it has no liking
/// for whole pixels. Where there is no texture the disparity stays as it was.
/// Writes rows [from, to) of `out`. Compiled for several instruction sets, chosen at run time.
void refine_subpixel(const SubpixelInput& in, int from, int to, std::int16_t* out);

}  // namespace crane
