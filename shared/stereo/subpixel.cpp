// SPDX-License-Identifier: Apache-2.0
// No Eigen, OpenCV or standard containers here: what this file compiles with wide instructions must
// not be merged by the linker into code for every processor.
#include "stereo/subpixel.hpp"

#include <cstdlib>

#include "base/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stereo/subpixel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace crane::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F32 = hn::ScalableTag<float>;
using Floats = hn::Vec<F32>;
constexpr int kReachX = 3, kReachY = 2;  ///< window 7 x 5
constexpr float kUnit = 32;              ///< disparity units of a pixel
constexpr float kSameSurface = 1.0F;     ///< [px]
/// Rows whose brightness along the row differs more than this, and than the row's own texture lets
/// expect, are not of the same surface [grey levels; share of the variance along the row].
constexpr float kSameBrightness = 24, kOwnTexture = 4;
constexpr int kAlong = 6;
/// Brightness noise over the error of the disparity before: grey levels^2 / px^2. Weak texture
/// moves the disparity little.
constexpr float kPrior = 100;
constexpr float kMaxChange = 0.75F;  ///< [px]

/// One row prepared: disparity, gradient along the row, and gradient * disparity - difference, so
/// that for a surface at disparity s: target = gradient * s.
struct Row {
  float* disparity;
  float* gradient;
  float* target;
  float* brightness;
  float* limit;
};

/// Mean brightness along the row, over 2 * kAlong + 1 pixels, and by how much that of another row
/// may differ, squared.
void brightness_along(const std::uint8_t* left, int width, float* mean, float* limit) {
  constexpr float kInverse = 1.0F / (2 * kAlong + 1);
  const int first = left[0];
  int sum = (kAlong + 1) * first;
  int squares = sum * first;
  for (int x = 1; x <= kAlong; ++x) sum += left[x], squares += left[x] * left[x];
  for (int x = 0; x < width; ++x) {
    const float m = float(sum) * kInverse;
    mean[x] = m;
    limit[x] =
        kSameBrightness * kSameBrightness + kOwnTexture * (float(squares) * kInverse - m * m);
    const int in = left[x + kAlong + 1 < width ? x + kAlong + 1 : width - 1];
    const int out = left[x > kAlong ? x - kAlong : 0];
    sum += in - out;
    squares += (in - out) * (in + out);
  }
}

void prepare(const SubpixelInput& in, int y, const Row& row) {
  const std::uint8_t* left = in.left + y * in.left_stride;
  brightness_along(left, in.width, row.brightness, row.limit);
  const std::uint8_t* right = in.right + y * in.right_stride;
  const std::int16_t* d = in.disparity + std::ptrdiff_t(y) * in.width;
  for (int x = 0; x < in.width; ++x) {
    const int whole = d[x] >> 5;
    const int r = x - whole - 1;  // the point lies between r and r + 1, or on r + 1
    row.disparity[x] = kNoDisparity;
    row.gradient[x] = row.target[x] = 0;
    if (d[x] <= 0 || r < 1 || r + 2 >= in.width || x + 1 >= in.width) continue;
    const float f = 1 - float(d[x] & 31) / kUnit;
    const float a = right[r - 1], b = right[r], c = right[r + 1], e = right[r + 2];
    const float there = b + f * (c - b);
    const float slope = (c - a) + f * ((e - b) - (c - a));  // twice the gradient
    const float gradient = 0.25F * (float(left[x + 1] - left[x - 1]) + slope);
    const float disparity = float(d[x]) / kUnit;
    row.disparity[x] = disparity;
    row.gradient[x] = gradient;
    row.target[x] = gradient * disparity - (float(left[x]) - there);
  }
}

void Refine(const SubpixelInput& in, int from, int to, const Subpixel& out) {
  const F32 d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  constexpr int kRows = 2 * kReachY + 1;
  constexpr int kEdge = 16;  // floats before and after a row: no surface there
  const std::ptrdiff_t row_size = in.width + 2 * kEdge;
  float* memory = static_cast<float*>(std::malloc(sizeof(float) * 5 * kRows * row_size));
  if (memory == nullptr) std::abort();
  Row ring[kRows];
  for (int i = 0; i < kRows; ++i) {
    float* at = memory + 5 * i * row_size;
    for (std::ptrdiff_t x = 0; x < 5 * row_size; ++x) at[x] = x < row_size ? kNoDisparity : 0;
    ring[i] = {at + kEdge, at + row_size + kEdge, at + 2 * row_size + kEdge,
               at + 3 * row_size + kEdge, at + 4 * row_size + kEdge};
  }
  const auto slot = [](int y) { return (y + kRows) % kRows; };
  for (int y = from - kReachY; y < from + kReachY; ++y)
    if (y >= 0 && y < in.rows) prepare(in, y, ring[slot(y)]);
  for (int y = from; y < to; ++y) {
    if (y + kReachY < in.rows) prepare(in, y + kReachY, ring[slot(y + kReachY)]);
    const int first = y < kReachY ? -y : -kReachY;
    const int last = y + kReachY < in.rows ? kReachY : in.rows - 1 - y;
    const Row& own = ring[slot(y)];
    const float* centre = own.disparity;
    for (int x = 0; x < in.width; x += lanes) {
      const Floats here = hn::LoadU(d, centre + x);
      const Floats bright = hn::LoadU(d, own.brightness + x);
      const Floats limit = hn::LoadU(d, own.limit + x);
      Floats n = hn::Zero(d), g = n, t = n, gg = n, gt = n;
      for (int dy = first; dy <= last; ++dy) {
        const Row& row = ring[slot(y + dy)];
        const Floats apart = hn::Sub(hn::LoadU(d, row.brightness + x), bright);
        const auto alike = hn::Le(hn::Mul(apart, apart), limit);
        for (int dx = -kReachX; dx <= kReachX; ++dx) {
          const Floats there = hn::LoadU(d, row.disparity + x + dx);
          const auto same =
              hn::And(alike, hn::Le(hn::Abs(hn::Sub(there, here)), hn::Set(d, kSameSurface)));
          const Floats gradient = hn::IfThenElseZero(same, hn::LoadU(d, row.gradient + x + dx));
          const Floats target = hn::IfThenElseZero(same, hn::LoadU(d, row.target + x + dx));
          n = hn::Add(n, hn::IfThenElseZero(same, hn::Set(d, 1.0F)));
          g = hn::Add(g, gradient);
          t = hn::Add(t, target);
          gg = hn::MulAdd(gradient, gradient, gg);
          gt = hn::MulAdd(gradient, target, gt);
        }
      }
      // target = gradient * s + offset, both unknown; s is pulled to `here` by the prior.
      const Floats mean = hn::Div(g, hn::Max(n, hn::Set(d, 1.0F)));
      const Floats weight = hn::Sub(gg, hn::Mul(mean, g));
      const Floats change = hn::Div(hn::Sub(hn::Sub(gt, hn::Mul(mean, t)), hn::Mul(weight, here)),
                                    hn::Add(weight, hn::Set(d, kPrior)));
      const Floats limited =
          hn::Min(hn::Max(change, hn::Set(d, -kMaxChange)), hn::Set(d, kMaxChange));
      const auto valid = hn::Gt(here, hn::Zero(d));
      const Floats refined =
          hn::IfThenElse(valid, hn::Add(here, limited), hn::Set(d, kNoDisparity));
      const std::ptrdiff_t at = std::ptrdiff_t(y) * in.width + x;
      if (x + lanes <= in.width) {
        hn::StoreU(refined, d, out.disparity + at);
        hn::StoreU(weight, d, out.weight + at);
        hn::StoreU(bright, d, out.brightness + at);
        hn::StoreU(limit, d, out.limit + at);
      } else {
        alignas(64) float rest[4][16];
        hn::Store(refined, d, rest[0]);
        hn::Store(weight, d, rest[1]);
        hn::Store(bright, d, rest[2]);
        hn::Store(limit, d, rest[3]);
        for (int i = 0; x + i < in.width; ++i) {
          out.disparity[at + i] = rest[0][i];
          out.weight[at + i] = rest[1][i];
          out.brightness[at + i] = rest[2][i];
          out.limit[at + i] = rest[3][i];
        }
      }
    }
  }
  std::free(memory);
}

constexpr int kStride = 3, kTaps = 2;     ///< taps of a window of 13 x 13
constexpr float kSupport = 8;             ///< taps on the same surface, of 25, itself included
constexpr float kBrightnessNoise = 2.8F;  ///< of a difference of two pixels [grey levels]
constexpr float kNoiseTexture = 40;       ///< weight that noise alone gives
constexpr float kSurroundingsTrust = 60;
constexpr float kSurroundings = 300;  ///< weight of the mean around

void Settle(const Subpixel& in, int width, int rows, int from, int to, std::int16_t* disparity,
            std::uint8_t* confidence) {
  const F32 d;
  const hn::RebindToSigned<F32> di;
  const int lanes = static_cast<int>(hn::Lanes(d));
  constexpr int kMargin = kStride * kTaps;
  for (int y = from; y < to; ++y) {
    std::int16_t* to_disparity = disparity + std::ptrdiff_t(y) * width;
    std::uint8_t* to_confidence = confidence + std::ptrdiff_t(y) * width;
    for (int x = 0; x < width; ++x) to_disparity[x] = 0, to_confidence[x] = 0;
    for (int x = kMargin; x < width - kMargin; x += lanes) {
      if (x + lanes > width - kMargin) x = width - kMargin - lanes;  // the last ones once more
      const std::ptrdiff_t at = std::ptrdiff_t(y) * width + x;
      const Floats here = hn::LoadU(d, in.disparity + at);
      const Floats bright = hn::LoadU(d, in.brightness + at);
      const Floats limit = hn::LoadU(d, in.limit + at);
      Floats n = hn::Zero(d), sum = n, squares = n, weights = n;
      for (int dy = -kTaps; dy <= kTaps; ++dy) {
        const int row = y + kStride * dy;
        if (row < 0 || row >= rows) continue;
        const std::ptrdiff_t tap = std::ptrdiff_t(row) * width + x;
        const Floats apart = hn::Sub(hn::LoadU(d, in.brightness + tap), bright);
        const auto alike = hn::Le(hn::Mul(apart, apart), limit);
        for (int dx = -kMargin; dx <= kMargin; dx += kStride) {
          const Floats there = hn::LoadU(d, in.disparity + tap + dx);
          const Floats step = hn::Sub(there, here);
          const auto same = hn::And(alike, hn::Le(hn::Abs(step), hn::Set(d, kSameSurface)));
          const Floats weight = hn::IfThenElseZero(
              same, hn::Add(hn::LoadU(d, in.weight + tap + dx), hn::Set(d, 1.0F)));
          n = hn::Add(n, hn::IfThenElseZero(same, hn::Set(d, 1.0F)));
          weights = hn::Add(weights, weight);
          const Floats weighted = hn::Mul(weight, step);
          sum = hn::Add(sum, weighted);
          squares = hn::MulAdd(weighted, step, squares);
        }
      }
      const Floats inverse = hn::Div(hn::Set(d, 1.0F), hn::Max(weights, hn::Set(d, 1.0F)));
      const Floats to_mean = hn::Mul(sum, inverse);
      const Floats own = hn::LoadU(d, in.weight + at);
      const Floats around = hn::Min(hn::Mul(weights, hn::Set(d, 0.25F)), hn::Set(d, kSurroundings));
      const Floats total = hn::Add(hn::Add(own, around), hn::Set(d, 1.0F));
      const Floats settled = hn::Add(here, hn::Mul(to_mean, hn::Div(around, total)));
      // What the texture promises (noise looks like texture, too, and neighbours err alike), and
      // what the scatter around shows.
      const Floats texture = hn::Add(hn::Max(hn::Sub(own, hn::Set(d, kNoiseTexture)), hn::Zero(d)),
                                     hn::Min(around, hn::Set(d, kSurroundingsTrust)));
      const Floats promised = hn::Div(hn::Set(d, kBrightnessNoise * kBrightnessNoise),
                                      hn::Max(texture, hn::Set(d, 1.0F)));
      const Floats scatter = hn::Sub(hn::Mul(squares, inverse), hn::Mul(to_mean, to_mean));
      const Floats variance = hn::Add(promised, hn::Max(scatter, hn::Zero(d)));
      const Floats trust = hn::Div(hn::Set(d, 255 * kBestSigmaPx), hn::Sqrt(variance));
      const auto good = hn::And(hn::Gt(here, hn::Zero(d)), hn::Ge(n, hn::Set(d, kSupport)));
      alignas(64) std::int32_t result[2][16];
      hn::Store(hn::NearestInt(hn::IfThenElseZero(good, hn::Mul(settled, hn::Set(d, kUnit)))), di,
                result[0]);
      hn::Store(hn::NearestInt(hn::IfThenElseZero(
                    good, hn::Min(hn::Max(trust, hn::Set(d, 1.0F)), hn::Set(d, 255.0F)))),
                di, result[1]);
      for (int i = 0; i < lanes; ++i) {
        to_disparity[x + i] = static_cast<std::int16_t>(result[0][i]);
        to_confidence[x + i] = static_cast<std::uint8_t>(result[1][i]);
      }
    }
  }
}

}  // namespace crane::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace crane {

HWY_EXPORT(Refine);
HWY_EXPORT(Settle);

void refine_subpixel(const SubpixelInput& in, int from, int to, const Subpixel& out) {
  HWY_DYNAMIC_DISPATCH(Refine)(in, from, to, out);
}

void settle_subpixel(const Subpixel& in, int width, int rows, int from, int to,
                     std::int16_t* disparity, std::uint8_t* confidence) {
  HWY_DYNAMIC_DISPATCH(Settle)(in, width, rows, from, to, disparity, confidence);
}

}  // namespace crane
#endif
