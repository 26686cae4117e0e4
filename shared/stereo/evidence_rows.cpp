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
using Floats = hn::Vec<F32>;
using Ints = hn::Vec<I32>;

constexpr int kUnit = 32;                    ///< disparity units of a pixel
constexpr int kPairs = kEvidenceWindow / 2;  ///< pixels are looked at in pairs
constexpr int kMargin = 32;                  ///< elements before and after a row
constexpr float kPixels = float(kEvidenceWindow);

/// What is summed along a row, pair by pair: matches, difference of the images, its square,
/// squared brightness gradient, brightness.
enum Part { kCount, kSum, kSquare, kGradient, kBrightness, kParts };

struct Pixels {
  Floats part[kParts];
};

/// The right image at x - disparity, times kUnit, between two of its pixels.
struct Moved {
  Ints brightness;
  hn::Mask<I32> inside;  ///< matched, and within the row
};

/// Of some pixels from x on.
HWY_INLINE Moved move(const EvidenceRow& in, int x) {
  const I32 di;
  const hn::Rebind<std::int16_t, I32> d16;
  const hn::Rebind<std::uint8_t, I32> d8;
  const int lanes = static_cast<int>(hn::Lanes(di));
  const Ints zero = hn::Zero(di);
  const Ints disparity = hn::PromoteTo(di, hn::LoadU(d16, in.disparity + x));
  const Ints part = hn::And(disparity, hn::Set(di, kUnit - 1));
  const Ints whole = hn::ShiftRight<5>(hn::Add(disparity, hn::Set(di, kUnit - 1)));
  const auto matched = hn::Gt(disparity, zero);
  const Ints weight = hn::IfThenElse(hn::Eq(part, zero), hn::Set(di, kUnit), part);
  const auto between = [&](Ints low, Ints high) {
    return hn::Add(hn::Mul(low, weight), hn::Mul(high, hn::Sub(hn::Set(di, kUnit), weight)));
  };
  // Most neighbours lie on one surface: their bytes lie side by side.
  const int first = x - hn::GetLane(whole);
  if (first >= 0 && first + lanes < in.width &&
      hn::AllTrue(di, hn::Eq(whole, hn::Set(di, hn::GetLane(whole)))))
    return {between(hn::PromoteTo(di, hn::LoadU(d8, in.right + first)),
                    hn::PromoteTo(di, hn::LoadU(d8, in.right + first + 1))),
            matched};
  const Ints at = hn::Sub(hn::Iota(di, x), whole);
  const auto inside =
      hn::And(matched, hn::And(hn::Gt(at, hn::Set(di, -1)), hn::Lt(at, hn::Set(di, in.width - 1))));
  // Four bytes at once: the two beside the point are among them.
  const Ints from = hn::Min(hn::Max(at, zero), hn::Set(di, in.width - 4));
  const Ints four = hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(in.right), from);
  const Ints skip = hn::Min(hn::Max(hn::Sub(at, from), zero), hn::Set(di, 2));
  const Ints two = hn::Shr(four, hn::ShiftLeft<3>(skip));
  const Ints byte = hn::Set(di, 255);
  return {between(hn::And(two, byte), hn::And(hn::ShiftRight<8>(two), byte)), inside};
}

/// Some pixels from x on. `left`: the row with margins.
HWY_INLINE Pixels look(const EvidenceRow& in, const std::uint8_t* left, int x) {
  const F32 d;
  const I32 di;
  const hn::Rebind<std::uint8_t, F32> d8;
  const Moved right = move(in, x);
  const Ints here = hn::PromoteTo(di, hn::LoadU(d8, left + x));
  const Ints step = hn::Sub(hn::PromoteTo(di, hn::LoadU(d8, left + x + 1)),
                            hn::PromoteTo(di, hn::LoadU(d8, left + x - 1)));
  const auto valid = hn::RebindMask(d, right.inside);
  const Floats difference = hn::IfThenElseZero(
      valid, hn::Mul(hn::ConvertTo(d, hn::Sub(hn::ShiftLeft<5>(here), right.brightness)),
                     hn::Set(d, 1.0F / kUnit)));
  return {{hn::IfThenElseZero(valid, hn::Set(d, 1.0F)), difference, hn::Mul(difference, difference),
           hn::ConvertTo(d, hn::Mul(step, step)), hn::ConvertTo(d, here)}};
}

/// Sum of the pairs around each one.
HWY_INLINE Floats window_sum(const float* pair) {
  const F32 d;
  Floats sum = hn::LoadU(d, pair - kPairs / 2);
  for (int i = 1; i < kPairs; ++i) sum = hn::Add(sum, hn::LoadU(d, pair - kPairs / 2 + i));
  return sum;
}

void LookAlongRow(const EvidenceRow& in, const EvidenceLimits& limits, EvidenceScratch& scratch,
                  std::uint8_t* mean, std::uint8_t* bits) {
  const F32 d;
  const I32 di;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const int pairs = in.width / 2;
  const std::ptrdiff_t stride = pairs + 2 * kMargin;
  std::uint8_t* left = scratch.bytes + kMargin;
  __builtin_memcpy(left, in.left, static_cast<std::size_t>(in.width));
  for (int i = 1; i <= kMargin; ++i)
    left[-i] = left[0], left[in.width - 1 + i] = left[in.width - 1];
  float* part[kParts];
  for (int p = 0; p < kParts; ++p) {
    part[p] = scratch.floats + p * stride + kMargin;
    for (int i = 1; i <= kMargin; ++i) part[p][-i] = part[p][pairs - 1 + i] = 0;
  }
  for (int pair = 0; pair < pairs; pair += lanes) {
    if (pair + lanes > pairs) pair = pairs - lanes;  // the last ones once more
    const Pixels low = look(in, left, 2 * pair);
    const Pixels high = look(in, left, 2 * pair + lanes);
    for (int p = 0; p < kParts; ++p)
      hn::StoreU(hn::Add(hn::ConcatEven(d, high.part[p], low.part[p]),
                         hn::ConcatOdd(d, high.part[p], low.part[p])),
                 d, part[p] + pair);
  }
  for (int i = 1; i <= kMargin; ++i) {
    part[kBrightness][-i] = 2.0F * left[0];
    part[kBrightness][pairs - 1 + i] = 2.0F * left[in.width - 1];
  }
  const Floats one = hn::Set(d, 1.0F);
  const Floats noise = hn::Set(d, 2 * limits.noise);
  const Floats slip = hn::Set(d, limits.slip_px * limits.slip_px / (4 * kPixels));
  for (int pair = 0; pair < pairs; pair += lanes) {
    const Floats n = window_sum(part[kCount] + pair);
    const Floats s = window_sum(part[kSum] + pair);
    const Floats gradient = window_sum(part[kGradient] + pair);
    const Floats spread =
        hn::Sub(window_sum(part[kSquare] + pair), hn::Div(hn::Mul(s, s), hn::Max(n, one)));
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
    alignas(64) std::int32_t out[2][16];
    hn::Store(hn::Or(hn::Or(bit(textured, kRowTextured), bit(explained, kRowExplained)),
                     hn::Or(bit(likely, kRowLikely), bit(distinct, kRowDistinct))),
              di, out[0]);
    hn::Store(hn::ConvertTo(
                  di, hn::Mul(window_sum(part[kBrightness] + pair), hn::Set(d, 1.0F / kPixels))),
              di, out[1]);
    const int some = pairs - pair < lanes ? pairs - pair : lanes;
    for (int i = 0; i < some; ++i) {
      const int x = 2 * (pair + i);
      bits[x] = bits[x + 1] = static_cast<std::uint8_t>(out[0][i]);
      mean[x] = mean[x + 1] = static_cast<std::uint8_t>(out[1][i]);
    }
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
