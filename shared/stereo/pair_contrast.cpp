// SPDX-License-Identifier: Apache-2.0
#include "stereo/pair_contrast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace crane {
namespace {

constexpr int kHalf = 4, kGrid = 36;  ///< [px]
constexpr int kPixels = (2 * kHalf + 1) * (2 * kHalf + 1);
constexpr int kBeside = 4;  ///< [px] from the disparity found to those it is compared with
/// Variance [grey^2] that rounding to whole levels and a little noise make of nothing.
constexpr double kFlat = 0.8;
/// Beside the match, what is left unexplained must be so many times more, and so large [grey^2]:
/// twice the deviation, and that by more than rounding to whole grey levels does.
constexpr double kTimesMore = 4, kLeast = 2.5;
constexpr double kTrusted = 0.5;      ///< share of the matched patches that must be distinct
constexpr int kEnough = 20;           ///< patches
constexpr double kAnyTexture = 0.05;  ///< share of the patches
constexpr double kDark = 32, kBright = 235, kFaint = 3;

/// Sums over a patch of one image; its brightness varies by `variance`.
struct Patch {
  int sum = 0;
  double variance = 0;
};

Patch look_at(const GreyView& image, int x, int y) {
  int sum = 0;
  int squares = 0;
  for (int v = -kHalf; v <= kHalf; ++v) {
    const std::uint8_t* row = image.pixels + (y + v) * image.stride + x;
    for (int u = -kHalf; u <= kHalf; ++u) {
      sum += row[u];
      squares += row[u] * row[u];
    }
  }
  return {sum, (squares - double(sum) * sum / kPixels) / kPixels};
}

/// Share of the variance of one patch that the other does not explain, whatever brightness and gain
/// either camera has: 1 - correlation; up to 2.
double unexplained(const GreyView& left, int x, const GreyView& right, int x_right, int y,
                   const Patch& a) {
  const Patch b = look_at(right, x_right, y);
  int products = 0;
  for (int v = -kHalf; v <= kHalf; ++v) {
    const std::uint8_t* l = left.pixels + (y + v) * left.stride + x;
    const std::uint8_t* r = right.pixels + (y + v) * right.stride + x_right;
    for (int u = -kHalf; u <= kHalf; ++u) products += l[u] * r[u];
  }
  const double covariance = (products - double(a.sum) * b.sum / kPixels) / kPixels;
  const double scale = std::sqrt(a.variance * b.variance);
  return scale > 0 ? 1 - covariance / scale : 1;
}

bool is_distinct(const GreyView& left, const GreyView& right, int x, int x_right, int y,
                 const Patch& patch, double flatter) {
  const auto at = [&](int beside) {
    return unexplained(left, x, right, x_right + beside, y, patch);
  };
  const double best = std::min({at(-1), at(0), at(1)});
  const double beside = std::max(at(-kBeside), at(kBeside));
  return beside >= kTimesMore * best && 2 * beside * flatter >= kLeast;
}

}  // namespace

PairContrast look_at_contrast(const GreyView& left, const GreyView& right,
                              std::span<const std::int16_t> disparity, std::int16_t first_valid) {
  PairContrast out;
  const int border = kHalf + kBeside + 1;
  double left_sum = 0;
  double right_sum = 0;
  std::vector<double> textures;
  for (int y = border; y < left.height - border; y += kGrid)
    for (int x = border; x < left.width - border; x += kGrid) {
      const Patch patch = look_at(left, x, y);
      const Patch same_place = look_at(right, x, y);
      ++out.patches;
      left_sum += patch.sum;
      right_sum += same_place.sum;
      const double flatter = std::min(patch.variance, same_place.variance);
      textures.push_back(flatter);
      out.textured += flatter > kFlat ? 1 : 0;
      const int d = disparity[std::size_t(y) * static_cast<std::size_t>(left.width) +
                              static_cast<std::size_t>(x)];
      const int x_right = x - (d + kDisparityScale / 2) / kDisparityScale;
      if (d < first_valid || x_right < border) continue;
      ++out.matched;
      const double seen = std::min(patch.variance, look_at(right, x_right, y).variance);
      out.distinct += is_distinct(left, right, x, x_right, y, patch, seen) ? 1 : 0;
    }
  if (out.patches == 0) return out;
  out.mean = std::min(left_sum, right_sum) / out.patches / kPixels;
  const auto middle = textures.begin() + static_cast<std::ptrdiff_t>(textures.size() / 2);
  std::nth_element(textures.begin(), middle, textures.end());
  out.texture = std::sqrt(std::max(0.0, *middle));
  return out;
}

std::optional<PairFlaw> flaw_of(const PairContrast& c) {
  // kLeftSaturated: white in both, wherever anything is to be seen.
  const PairFlaw why = c.mean < kDark       ? PairFlaw::kTooDark
                       : c.mean > kBright   ? PairFlaw::kLeftSaturated
                       : c.texture < kFaint ? PairFlaw::kNoContrast
                                            : PairFlaw::kTooNoisy;
  if (c.matched >= kEnough && c.distinct < kTrusted * c.matched) return why;
  // So little matches that nothing is to be seen of the reason: but this much is.
  if (c.matched < kEnough && c.textured < kAnyTexture * c.patches) return why;
  return std::nullopt;
}

}  // namespace crane
