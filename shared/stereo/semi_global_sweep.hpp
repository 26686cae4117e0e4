// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace crane {

/// The inner loops of SemiGlobalMatcher, compiled for several instruction sets; the best one of the
/// processor is chosen at run time. Plain pointers only: this header is all that the translation
/// unit with those instructions shares with the rest.

/// Pixels around an image that the census reads beyond its borders.
inline constexpr int kCensusReachX = 3, kCensusReachY = 3;
/// A census signature is kept as planes of four bits, one byte each: a table counts them at once.
inline constexpr int kCensusPlanes = 6;
/// Rounding of the number of disparities.
inline constexpr int kDisparityStep = 32;
inline constexpr int kMaxDisparities = 256;
/// Bytes that may be read or written beyond what is of use in a row.
inline constexpr int kSlack = 64;

/// Centre-symmetric census over 7 x 7 pixels: 24 bits, each whether a pixel is brighter than the
/// one opposite. `padded` is a row pointer into an image with kCensusReach* pixels around it,
/// brightness minus 128; writes `width` bytes to each plane, rounded up to 32. `mirrored`: the
/// image is, and gets the same signatures as if it were not.
void census_row(const std::int8_t* padded, std::ptrdiff_t stride, int width, bool mirrored,
                std::uint8_t* const planes[kCensusPlanes]);

struct SweepInput {
  int width = 0, height = 0;
  int first = 0, disparities = 0;  ///< searched: first .. first + disparities - 1 [px]
  const std::uint8_t* left[kCensusPlanes] = {};   ///< census of the left image, row by row
  const std::uint8_t* right[kCensusPlanes] = {};  ///< of the right one, each row mirrored
  std::ptrdiff_t left_stride = 0, right_stride = 0;
  std::uint8_t p1 = 0;  ///< cost of one pixel more or less
  /// height x width: cost of a larger jump between a pixel and the one left of it, and above it.
  const std::uint8_t* p2_left = nullptr;
  const std::uint8_t* p2_above = nullptr;
  std::uint8_t* sums = nullptr;  ///< height x width x disparities
};

/// What a direction of travel carries from row to row, and what a pair of its rows carries from
/// part to part.
struct SweepState {
  std::uint8_t* path = nullptr;        ///< width x disparities: costs of the vertical path
  std::uint8_t* right_best = nullptr;  ///< 2 rows of width + first + disparities + 2 kSlack
  std::uint8_t* carried = nullptr;     ///< 6 x disparities, aligned as `path`
};

/// Some columns of one row, or of two beside each other, as they are travelled.
struct SweepPart {
  int y = 0, rows = 2;     ///< the row that comes first, and how many
  int direction = 1;       ///< +1: rows down and pixels right, -1: up and left
  int begin = 0, end = 0;  ///< columns from the start of the travel on, of width - first
  bool finish = false;     ///< the sums of the other direction are there: find the winners
};

/// The winner of each pixel.
struct SweepOutput {
  std::int16_t* disparity = nullptr;  ///< height x width, 1/32 px; 0 = none
  std::uint8_t* margin = nullptr;     ///< height x width: second best sum less the best one
  int left_right = 1;                 ///< allowed difference of the left and the right winner [px]
  int uniqueness = 0;                 ///< least margin
  std::uint32_t* at_near_end = nullptr;  ///< counts winners at the near end: refused
};

/// Adds the two paths that come from behind (along the row, and vertically) in the direction of
/// travel. Parts of a row come one after another; the same columns of the row before it are done.
void sweep(const SweepInput& in, SweepState& state, const SweepPart& part, const SweepOutput& out);

}  // namespace crane
