// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace crane {

/// Edge of the square that is compared [px].
inline constexpr int kSweepEdge = 16;

/// One square of an image, and where in another one it is looked for.
struct SweepCell {
  const std::uint8_t* here = nullptr;  ///< its first pixel
  std::ptrdiff_t here_stride = 0;
  const std::uint8_t* there = nullptr;  ///< the other image
  std::ptrdiff_t there_stride = 0;
  const std::int32_t* offsets = nullptr;  ///< of the first pixel in it; below 0 = outside
  int count = 0;
};
inline constexpr std::uint16_t kNotVisible = 0xFFFF;

/// Sums of absolute differences of 16 x 16 pixels, divided by 2, for each offset; kNotVisible
/// outside. Compiled for several instruction sets, chosen at run time.
void sweep_cell(const SweepCell& cell, std::uint16_t* costs);
/// The same, slowly: what the test compares with.
void sweep_cell_slow(const SweepCell& cell, std::uint16_t* costs);

}  // namespace crane
