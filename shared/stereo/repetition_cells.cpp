// SPDX-License-Identifier: Apache-2.0
// No Eigen, OpenCV or standard containers here: what this file compiles with wide instructions must
// not be merged by the linker into code for every processor.
#include "stereo/repetition_cells.hpp"

#include "base/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stereo/repetition_cells.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace crane::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kRowStep = 8;     ///< of a cell's rows these are looked at
constexpr int kLeastShift = 3;  ///< [px]
constexpr int kMaxColumns = 256;
/// Alike: a difference of at most this share of the largest one at a smaller shift, which is more
/// than noise.
constexpr int kAlikePercent = 28, kUnlike = 6;
/// Two cells beside each other are looked at as one.
constexpr int kSamples = 2 * kRepetitionCell * (kRepetitionCell / kRowStep);

using U8 = hn::CappedTag<std::uint8_t, kRepetitionCell>;

/// Sum of absolute differences of a cell and its like `shift` px to the left.
HWY_INLINE int difference(const RepetitionInput& in, int x, int y, int shift) {
  const U8 d;
  const hn::Repartition<std::uint64_t, U8> d64;
  auto sum = hn::Zero(d64);
  for (int row = kRowStep / 2; row < kRepetitionCell; row += kRowStep) {
    const std::uint8_t* here = in.pixels + (y + row) * in.stride + x;
    for (int i = 0; i < kRepetitionCell; i += static_cast<int>(hn::Lanes(d))) {
      const auto a = hn::LoadU(d, here + i);
      const auto b = hn::LoadU(d, here + i - shift);
      sum = hn::Add(sum, hn::SumsOf8(hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a))));
    }
  }
  return static_cast<int>(hn::GetLane(hn::SumOfLanes(d64, sum)));
}

void FindRepetition(const RepetitionInput& in, int from, int to, std::uint8_t* repeats) {
  const int columns =
      in.width / kRepetitionCell < kMaxColumns ? in.width / kRepetitionCell : kMaxColumns;
  const int stride = in.width / kRepetitionCell;
  for (int row = from; row < to; ++row) {
    std::uint8_t* out = repeats + row * stride;
    for (int c = 0; c < stride; ++c) out[c] = 0;
    for (int side = -1; side <= 1; side += 2) {
      int most[kMaxColumns] = {};
      int now[kMaxColumns];
      for (int s = 1; s <= in.reach; ++s) {
        const int shift = side * s;
        for (int c = 0; c < columns; ++c) {
          const int x = c * kRepetitionCell;
          const bool inside = x - shift >= 0 && x + kRepetitionCell - shift <= in.width;
          now[c] = inside ? difference(in, x, row * kRepetitionCell, shift) : -1;
        }
        for (int c = 0; c + 1 < columns; ++c) {
          if (now[c] < 0 || now[c + 1] < 0) continue;
          const int both = now[c] + now[c + 1];
          most[c] = both > most[c] ? both : most[c];
          if (s >= kLeastShift && most[c] > kUnlike * kSamples &&
              100 * both < kAlikePercent * most[c])
            out[c] = out[c + 1] = 1;
        }
      }
    }
  }
}

}  // namespace crane::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace crane {

HWY_EXPORT(FindRepetition);

void find_repetition(const RepetitionInput& in, int from, int to, std::uint8_t* repeats) {
  HWY_DYNAMIC_DISPATCH(FindRepetition)(in, from, to, repeats);
}

}  // namespace crane
#endif
