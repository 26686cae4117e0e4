// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace crane {

/// How many of 24 neighbours (a 9 x 9 grid, every other pixel) agree with a pixel's disparity
/// within one pixel; the share becomes its confidence, 0..255. An isolated mismatch has none.
/// In:  height x width int16 disparity, 1/32 px; values below `first_valid` are no match.
/// Out: height x width uint8; 0 where there is no match.
/// Cost: 24 passes over each row, vectorised.
void disparity_support(std::span<const std::int16_t> disparity, std::size_t width,
                       std::size_t height, std::int16_t first_valid,
                       std::span<std::uint8_t> confidence);

}  // namespace crane
