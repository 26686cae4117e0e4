// SPDX-License-Identifier: Apache-2.0
// No Eigen, OpenCV or standard containers here: what this file compiles with wide instructions must
// not be merged by the linker into code for every processor.
#include "motion/cell_window.hpp"

#include "base/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "motion/cell_window.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace crane::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F32 = hn::CappedTag<float, 8>;
using Floats = hn::Vec<F32>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(F32()));
constexpr int kVectors = 24 / kLanes;  ///< of a row: so many sums that do not wait for each other
static_assert(kWindowEdge == kVectors * kLanes);

HWY_INLINE Floats load(const std::uint8_t* bytes) {
  const hn::Rebind<std::uint8_t, F32> d8;
  const hn::RebindToSigned<F32> di;
  return hn::ConvertTo(F32(), hn::PromoteTo(di, hn::LoadU(d8, bytes)));
}

HWY_INLINE float total(const Floats (&sums)[kVectors]) {
  Floats all = sums[0];
  for (int v = 1; v < kVectors; ++v) all = hn::Add(all, sums[v]);
  return hn::GetLane(hn::SumOfLanes(F32(), all));
}

float Difference(const float* here, const std::uint8_t* there, std::ptrdiff_t stride, float fx,
                 float fy, float* difference) {
  const F32 d;
  const Floats right = hn::Set(d, fx);
  const Floats below = hn::Set(d, fy);
  Floats sums[kVectors], before[kVectors];
  for (int v = 0; v < kVectors; ++v) {
    sums[v] = hn::Zero(d);
    const Floats at = load(there + v * kLanes);
    before[v] = hn::MulAdd(right, hn::Sub(load(there + v * kLanes + 1), at), at);
  }
  for (int row = 0; row < kWindowEdge; ++row) {
    there += stride;
    for (int v = 0; v < kVectors; ++v) {
      const int i = row * kWindowEdge + v * kLanes;
      const Floats at = load(there + v * kLanes);
      const Floats low = hn::MulAdd(right, hn::Sub(load(there + v * kLanes + 1), at), at);
      const Floats moved = hn::MulAdd(below, hn::Sub(low, before[v]), before[v]);
      const Floats apart = hn::Sub(hn::LoadU(d, here + i), moved);
      hn::StoreU(apart, d, difference + i);
      sums[v] = hn::Add(sums[v], apart);
      before[v] = low;
    }
  }
  return total(sums) / float(kWindowPixels);
}

WindowSums Sums(const WindowDifference& in, float mx, float my) {
  const F32 d;
  const Floats x = hn::Set(d, mx);
  const Floats y = hn::Set(d, my);
  const Floats mean = hn::Set(d, in.mean);
  const Floats nine = hn::Set(d, 9 * in.noise);
  Floats gg[kVectors], gr[kVectors];
  for (int v = 0; v < kVectors; ++v) gg[v] = gr[v] = hn::Zero(d);
  for (int row = 0; row < kWindowEdge; ++row)
    for (int v = 0; v < kVectors; ++v) {
      const int i = row * kWindowEdge + v * kLanes;
      const Floats gx = hn::LoadU(d, in.gx + i);
      const Floats gy = hn::LoadU(d, in.gy + i);
      const Floats r = hn::Sub(hn::LoadU(d, in.difference + i), mean);
      const Floats g = hn::MulAdd(gx, x, hn::Mul(gy, y));
      const Floats slack = hn::MulAdd(gx, gx, hn::MulAdd(gy, gy, nine));
      const Floats w = hn::Div(slack, hn::MulAdd(r, r, slack));
      const Floats weighted = hn::Mul(w, g);
      gg[v] = hn::MulAdd(weighted, g, gg[v]);
      gr[v] = hn::MulAdd(weighted, r, gr[v]);
    }
  return {total(gg), total(gr)};
}

float Misfit(const WindowDifference& in, float slip_px) {
  const F32 d;
  const Floats mean = hn::Set(d, in.mean);
  const Floats noise = hn::Set(d, in.noise);
  const Floats slip = hn::Set(d, slip_px * slip_px);
  Floats sums[kVectors];
  for (Floats& sum : sums) sum = hn::Zero(d);
  for (int row = 0; row < kWindowEdge; ++row)
    for (int v = 0; v < kVectors; ++v) {
      const int i = row * kWindowEdge + v * kLanes;
      const Floats gx = hn::LoadU(d, in.gx + i);
      const Floats gy = hn::LoadU(d, in.gy + i);
      const Floats r = hn::Sub(hn::LoadU(d, in.difference + i), mean);
      const Floats g = hn::MulAdd(gx, gx, hn::Mul(gy, gy));
      sums[v] = hn::Add(sums[v], hn::Div(hn::Mul(r, r), hn::MulAdd(slip, g, noise)));
    }
  return total(sums) / float(kWindowPixels);
}

}  // namespace crane::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace crane {

HWY_EXPORT(Difference);
HWY_EXPORT(Sums);
HWY_EXPORT(Misfit);

float window_difference(const float* here, const std::uint8_t* there, std::ptrdiff_t stride,
                        float fx, float fy, float* difference) {
  return HWY_DYNAMIC_DISPATCH(Difference)(here, there, stride, fx, fy, difference);
}

WindowSums window_sums(const WindowDifference& in, float mx, float my) {
  return HWY_DYNAMIC_DISPATCH(Sums)(in, mx, my);
}

float window_misfit(const WindowDifference& in, float slip_px) {
  return HWY_DYNAMIC_DISPATCH(Misfit)(in, slip_px);
}

}  // namespace crane
#endif
