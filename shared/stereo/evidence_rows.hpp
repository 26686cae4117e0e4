// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace crane {

/// Pixels along the row that are looked at together.
inline constexpr int kEvidenceWindow = 14;

/// One row of a rectified pair and the disparities found in it.
struct EvidenceRow {
  const std::uint8_t* left = nullptr;
  const std::uint8_t* right = nullptr;
  const std::int16_t* disparity = nullptr;  ///< 1/32 px; <= 0 = none
  int width = 0;
};

/// What is asked of a row around a pixel. Brightness in grey levels.
struct EvidenceLimits {
  float noise = 4;          ///< variance of one pixel's brightness
  float residual = 3;       ///< variance of the difference of the images, in that of their noise
  float weak_residual = 9;  ///< up to here a match is still likely
  float slip_px = 0.35F;    ///< error of a good disparity
  float texture = 2;        ///< sum of squared gradients, in what noise alone gives
  float distinct = 2.5F;    ///< so much of it fits nowhere by chance
};

/// Bits of what was found.
inline constexpr std::uint8_t kRowTextured = 1, kRowExplained = 2, kRowLikely = 4, kRowDistinct = 8;

/// Memory that a row needs.
struct EvidenceScratch {
  std::int32_t* sums = nullptr;   ///< evidence_sums(width)
  std::uint8_t* bytes = nullptr;  ///< evidence_bytes(width)
};
constexpr std::size_t evidence_sums(int width) {
  return 5 * (static_cast<std::size_t>(width) / 2 + 64);
}
constexpr std::size_t evidence_bytes(int width) {
  return static_cast<std::size_t>(width) + 64;
}

/// Out, each of `width`, which is at least 64: mean brightness along the row, and bits of the
/// above. Compiled for several instruction sets, chosen at run time.
void look_along_row(const EvidenceRow& row, const EvidenceLimits& limits, EvidenceScratch& scratch,
                    std::uint8_t* mean, std::uint8_t* bits);

/// Variance of the difference between the left and the moved right image around column x [grey
/// levels^2]; negative = not all of it matched.
float row_residual(const EvidenceRow& row, int x);

}  // namespace crane
