// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace crane {

/// Edge of the cells that are looked at for repetition [px].
inline constexpr int kRepetitionCell = 32;

/// Rows of one grey image.
struct RepetitionInput {
  const std::uint8_t* pixels = nullptr;
  std::ptrdiff_t stride = 0;
  int width = 0, height = 0;  ///< [px]; at least a cell
  int reach = 0;              ///< shifts along the row to look at [px]
};

/// Where an image repeats itself along its rows: shifted by up to `reach` px to either side it
/// first becomes unlike itself and then alike again. What is there fits at several disparities, and
/// a matcher's choice among them is chance.
/// Out, for cell rows [from, to): repeats[row * columns + column] = 1, columns = width / 32.
/// Compiled for several instruction sets, chosen at run time.
void find_repetition(const RepetitionInput& in, int from, int to, std::uint8_t* repeats);

}  // namespace crane
