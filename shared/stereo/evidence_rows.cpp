// SPDX-License-Identifier: Apache-2.0
// No Eigen, OpenCV or standard containers here: what this file compiles with wide instructions must
// not be merged by the linker into code for every processor.
#include "stereo/evidence_rows.hpp"

#include "base/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stereo/evidence_rows.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace crane::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F32 = hn::ScalableTag<float>;
using I32 = hn::RebindToSigned<F32>;
using I16 = hn::Repartition<std::int16_t, I32>;
using Floats = hn::Vec<F32>;
using Ints = hn::Vec<I32>;
using Shorts = hn::Vec<I16>;

constexpr int kUnit = 32;                    ///< disparity units of a pixel
constexpr int kPairs = kEvidenceWindow / 2;  ///< pixels are looked at in pairs
constexpr int kMargin = 32;                  ///< elements before and after a row
constexpr float kPixels = float(kEvidenceWindow);

/// What is summed along a row, pair by pair: matches, difference of the images [1/kUnit], its
/// square, squared brightness gradient, brightness.
enum Part { kCount, kSum, kSquare, kGradient, kBrightness, kParts };

/// Eight pixels beside each other: of the right image the two that each match lies between.
struct Beside {
  hn::Vec<hn::FixedTag<std::int16_t, 8>> low, high, inside;
};

/// `whole`: disparities rounded up; `matched`: all bits or none.
HWY_INLINE Beside look_one_by_one(const EvidenceRow& in, int x) {
  const hn::FixedTag<std::int16_t, 8> d;
  alignas(16) std::int16_t low[8], high[8], inside[8];
  for (int i = 0; i < 8; ++i) {
    const int at = x + i - (in.disparity[x + i] + kUnit - 1) / kUnit;
    const bool there = in.disparity[x + i] > 0 && at >= 0 && at + 1 < in.width;
    low[i] = there ? in.right[at] : std::int16_t{0};
    high[i] = there ? in.right[at + 1] : std::int16_t{0};
    inside[i] = there ? std::int16_t{-1} : std::int16_t{0};
  }
  return {hn::Load(d, low), hn::Load(d, high), hn::Load(d, inside)};
}

/// Pixels x .. x + 7. Neighbours mostly lie on one surface: what they need lies within 16 bytes.
HWY_INLINE Beside look_beside(const EvidenceRow& in, int x) {
  const hn::FixedTag<std::int16_t, 8> d;
  const hn::FixedTag<std::uint8_t, 16> bytes;
  const hn::FixedTag<std::uint8_t, 8> d8;
  const auto disparity = hn::LoadU(d, in.disparity + x);
  const auto matched = hn::Gt(disparity, hn::Zero(d));
  const auto whole =
      hn::IfThenElseZero(matched, hn::ShiftRight<5>(hn::Add(disparity, hn::Set(d, kUnit - 1))));
  const auto most = hn::MaxOfLanes(d, whole);
  const int from = x - hn::GetLane(most);
  const auto at = hn::Add(hn::Iota(d, 0), hn::IfThenElseZero(matched, hn::Sub(most, whole)));
  if (from < 0 || from + 16 > in.width || !hn::AllTrue(d, hn::Lt(at, hn::Set(d, 15))))
    return look_one_by_one(in, x);
  const auto here = hn::LoadU(bytes, in.right + from);
  const auto low = hn::Combine(bytes, hn::DemoteTo(d8, at), hn::DemoteTo(d8, at));
  const auto high = hn::Add(low, hn::Set(bytes, 1));
  return {hn::PromoteTo(d, hn::LowerHalf(hn::TableLookupBytes(here, low))),
          hn::PromoteTo(d, hn::LowerHalf(hn::TableLookupBytes(here, high))),
          hn::VecFromMask(d, matched)};
}

#if HWY_TARGET == HWY_AVX2
HWY_INLINE Shorts joined(hn::Vec<hn::FixedTag<std::int16_t, 8>> low,
                         hn::Vec<hn::FixedTag<std::int16_t, 8>> high) {
  return hn::Combine(I16(), high, low);
}
#endif

/// Sums of the products of two neighbours each.
HWY_INLINE Ints pair_sums(Shorts a, Shorts b) {
  const I32 d;
#if HWY_ARCH_X86
  Ints unused = hn::Zero(d);
  return hn::ReorderWidenMulAccumulate(d, a, b, hn::Zero(d), unused);  // pmaddwd: in order
#else
  const auto odd = [&](Shorts v) { return hn::ShiftRight<16>(hn::BitCast(d, v)); };
  const auto even = [&](Shorts v) {
    return hn::ShiftRight<16>(hn::ShiftLeft<16>(hn::BitCast(d, v)));
  };
  return hn::Add(hn::Mul(even(a), even(b)), hn::Mul(odd(a), odd(b)));
#endif
}

/// Some pixels from x on, as many as Shorts holds, pair by pair. `left`: the row with margins.
HWY_INLINE void look(const EvidenceRow& in, const std::uint8_t* left, int x,
                     std::int32_t* const part[kParts]) {
  const I16 d;
  const I32 d32;
  const hn::Rebind<std::uint8_t, I16> d8;
#if HWY_TARGET == HWY_AVX2
  const Beside a = look_beside(in, x);
  const Beside b = look_beside(in, x + 8);
  const Shorts low = joined(a.low, b.low);
  const Shorts high = joined(a.high, b.high);
  const Shorts inside = joined(a.inside, b.inside);
#else
  const auto [low, high, inside] = look_beside(in, x);
#endif
  const Shorts one = hn::Set(d, 1);
  const Shorts fraction = hn::And(hn::LoadU(d, in.disparity + x), hn::Set(d, kUnit - 1));
  const Shorts weight = hn::IfThenElse(hn::Eq(fraction, hn::Zero(d)), hn::Set(d, kUnit), fraction);
  const Shorts there =
      hn::Add(hn::Mul(low, weight), hn::Mul(high, hn::Sub(hn::Set(d, kUnit), weight)));
  const Shorts here = hn::PromoteTo(d, hn::LoadU(d8, left + x));
  const Shorts step = hn::Sub(hn::PromoteTo(d, hn::LoadU(d8, left + x + 1)),
                              hn::PromoteTo(d, hn::LoadU(d8, left + x - 1)));
  const Shorts difference = hn::And(inside, hn::Sub(hn::ShiftLeft<5>(here), there));
  const auto pairs = [&](Part which, Shorts a, Shorts b) {
    hn::StoreU(pair_sums(a, b), d32, part[which] + x / 2);
  };
  pairs(kCount, hn::And(inside, one), one);
  pairs(kSum, difference, one);
  pairs(kSquare, difference, difference);
  pairs(kGradient, step, step);
  pairs(kBrightness, here, one);
}

/// Sum of the pairs around each one.
HWY_INLINE Floats window_sum(const std::int32_t* pair) {
  const I32 d;
  Ints sum = hn::LoadU(d, pair - kPairs / 2);
  for (int i = 1; i < kPairs; ++i) sum = hn::Add(sum, hn::LoadU(d, pair - kPairs / 2 + i));
  return hn::ConvertTo(F32(), sum);
}

void LookAlongRow(const EvidenceRow& in, const EvidenceLimits& limits, EvidenceScratch& scratch,
                  std::uint8_t* mean, std::uint8_t* bits) {
  const F32 d;
  const I32 di;
  const hn::Rebind<std::uint16_t, I32> d16;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const int pairs = in.width / 2;
  const std::ptrdiff_t stride = pairs + 2 * kMargin;
  std::uint8_t* left = scratch.bytes + kMargin;
  __builtin_memcpy(left, in.left, static_cast<std::size_t>(in.width));
  for (int i = 1; i <= kMargin; ++i)
    left[-i] = left[0], left[in.width - 1 + i] = left[in.width - 1];
  std::int32_t* part[kParts];
  for (int p = 0; p < kParts; ++p) part[p] = scratch.sums + p * stride + kMargin;
  for (int pair = 0; pair < pairs; pair += lanes) {
    if (pair + lanes > pairs) pair = pairs - lanes;  // the last ones once more
    look(in, left, 2 * pair, part);
  }
  for (int i = 1; i <= kMargin; ++i) {
    for (int p = 0; p < kBrightness; ++p) part[p][-i] = part[p][pairs - 1 + i] = 0;
    part[kBrightness][-i] = 2 * left[0];
    part[kBrightness][pairs - 1 + i] = 2 * left[in.width - 1];
  }
  const Floats one = hn::Set(d, 1.0F);
  const Floats unit = hn::Set(d, 1.0F / (kUnit * kUnit));
  const Floats noise = hn::Set(d, 2 * limits.noise);
  const Floats slip = hn::Set(d, limits.slip_px * limits.slip_px / (4 * kPixels));
  for (int pair = 0; pair < pairs; pair += lanes) {
    if (pair + lanes > pairs) pair = pairs - lanes;
    const Floats n = window_sum(part[kCount] + pair);
    const Floats s = window_sum(part[kSum] + pair);
    const Floats gradient = window_sum(part[kGradient] + pair);
    const Floats spread = hn::Mul(
        unit, hn::Sub(window_sum(part[kSquare] + pair), hn::Div(hn::Mul(s, s), hn::Max(n, one))));
    const Floats residual = hn::Div(spread, hn::Max(hn::Sub(n, one), one));
    const Floats slack = hn::Mul(slip, gradient);
    const auto bit = [&](auto mask, int value) {
      return hn::IfThenElseZero(hn::RebindMask(di, mask), hn::Set(di, value));
    };
    const auto textured = hn::Gt(gradient, hn::Mul(noise, hn::Set(d, limits.texture * kPixels)));
    const auto distinct = hn::Gt(gradient, hn::Mul(noise, hn::Set(d, limits.distinct * kPixels)));
    const auto explained = hn::Lt(residual, hn::MulAdd(noise, hn::Set(d, limits.residual), slack));
    const auto likely =
        hn::Lt(residual, hn::MulAdd(noise, hn::Set(d, limits.weak_residual), slack));
    // The same for both pixels of a pair.
    const auto put = [&](Ints values, std::uint8_t* out) {
      const auto twice = hn::DemoteTo(d16, hn::Mul(values, hn::Set(di, 0x0101)));
      hn::StoreU(twice, d16, reinterpret_cast<std::uint16_t*>(out + 2 * pair));
    };
    put(hn::Or(hn::Or(bit(textured, kRowTextured), bit(explained, kRowExplained)),
               hn::Or(bit(likely, kRowLikely), bit(distinct, kRowDistinct))),
        bits);
    put(hn::ConvertTo(di,
                      hn::Mul(window_sum(part[kBrightness] + pair), hn::Set(d, 1.0F / kPixels))),
        mean);
  }
  if (in.width % 2 != 0) {
    bits[in.width - 1] = bits[in.width - 2];
    mean[in.width - 1] = mean[in.width - 2];
  }
}

}  // namespace crane::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace crane {

HWY_EXPORT(LookAlongRow);

void look_along_row(const EvidenceRow& row, const EvidenceLimits& limits, EvidenceScratch& scratch,
                    std::uint8_t* mean, std::uint8_t* bits) {
  HWY_DYNAMIC_DISPATCH(LookAlongRow)(row, limits, scratch, mean, bits);
}

float row_residual(const EvidenceRow& row, int x) {
  constexpr int kUnit = 32;
  float sum = 0;
  float squares = 0;
  for (int i = x - kEvidenceWindow / 2; i < x + kEvidenceWindow / 2; ++i) {
    const int d = row.disparity[i];
    const int part = d & (kUnit - 1);
    const int at = i - d / kUnit - (part > 0 ? 1 : 0);
    if (d <= 0 || at < 0 || at + 1 >= row.width) return -1;
    const int there = part > 0 ? row.right[at] * part + row.right[at + 1] * (kUnit - part)
                               : row.right[at] * kUnit;
    const float e = static_cast<float>(row.left[i] * kUnit - there) / kUnit;
    sum += e;
    squares += e * e;
  }
  return (squares - sum * sum / kEvidenceWindow) / (kEvidenceWindow - 1);
}

}  // namespace crane
#endif
