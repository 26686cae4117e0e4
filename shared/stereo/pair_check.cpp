// SPDX-License-Identifier: Apache-2.0
#include "stereo/pair_check.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace crane {
namespace {

constexpr int kBlack = 6, kSaturated = 250;                    ///< grey levels
constexpr double kMostlyBlack = 0.98, kMostlySaturated = 0.9;  ///< shares of the pixels

struct Look {
  double black = 0, saturated = 0;  ///< shares
  std::uint64_t sum = 0;            ///< changes with any pixel looked at
};

/// Every fourth row.
Look look_at(const GreyView& image) {
  std::uint64_t black = 0, saturated = 0, pixels = 0;
  Look out;
  for (int y = 0; y < image.height; y += 4) {
    const std::uint8_t* row = image.pixels + y * image.stride;
    std::uint32_t dark = 0, bright = 0, sum = 0, weighted = 0;
    for (int x = 0; x < image.width; ++x) {
      dark += row[x] < kBlack ? 1 : 0;
      bright += row[x] >= kSaturated ? 1 : 0;
      sum += row[x];
      weighted += row[x] * static_cast<std::uint32_t>(x);
    }
    black += dark;
    saturated += bright;
    pixels += static_cast<std::uint64_t>(image.width);
    out.sum = out.sum * 0x9E3779B97F4A7C15ULL + (std::uint64_t{sum} << 32U) + weighted;
  }
  out.black = double(black) / double(pixels);
  out.saturated = double(saturated) / double(pixels);
  return out;
}

}  // namespace

const char* advice(PairFlaw flaw) {
  switch (flaw) {
    case PairFlaw::kLeftBlack:
    case PairFlaw::kRightBlack:
      return "an image is black: is the camera covered, its exposure too short, the light off?";
    case PairFlaw::kLeftSaturated:
    case PairFlaw::kRightSaturated:
      return "an image is saturated: shorten the exposure";
    case PairFlaw::kLeftFrozen:
    case PairFlaw::kRightFrozen:
      return "a camera repeats its last image: restart it";
    case PairFlaw::kNoOverlap:
      return "hardly a pixel matches: are the cameras swapped, covered, out of step, drowned in "
             "noise, or nearer to "
             "the "
             "scene than stereo.nearest_m?";
    case PairFlaw::kTooDark:
      return "the images are too dark to tell an obstacle from the floor: lengthen the exposure, "
             "or "
             "light the floor";
    case PairFlaw::kNoContrast:
      return "the images have hardly any contrast: is there fog or dust, is the lens clean and in "
             "focus?";
    case PairFlaw::kTooNoisy:
      return "left and right differ by noise as much as by what they show: lower the gain, light "
             "the "
             "floor, and check that both cameras expose together";
  }
  return "";
}

std::optional<PairFlaw> PairCheck::look(const GreyView& left, const GreyView& right,
                                        std::int64_t number) {
  const Look l = look_at(left);
  const Look r = look_at(right);
  const bool another = number_ >= 0 && number != number_;
  const bool left_same = another && l.sum == left_sum_;
  const bool right_same = another && r.sum == right_sum_;
  number_ = number;
  left_sum_ = l.sum;
  right_sum_ = r.sum;
  if (l.black > kMostlyBlack) return PairFlaw::kLeftBlack;
  if (r.black > kMostlyBlack) return PairFlaw::kRightBlack;
  if (l.saturated > kMostlySaturated) return PairFlaw::kLeftSaturated;
  if (r.saturated > kMostlySaturated) return PairFlaw::kRightSaturated;
  if (left_same) return PairFlaw::kLeftFrozen;
  if (right_same) return PairFlaw::kRightFrozen;
  return std::nullopt;
}

namespace {

struct RowSample {
  double x, y, rows;  ///< [px] from the middle of the image
};

std::vector<RowSample> measure_rows(const GreyView& left, const GreyView& right,
                                    std::span<const std::int16_t> disparity) {
  constexpr int kReach = 6, kHalf = 4, kGrid = 32;
  constexpr int kTexture = 2;  ///< a wrong row must differ so many times more than the best one
  std::vector<RowSample> out;
  const int border = kReach + kHalf + 1;
  for (int y = border; y < left.height - border; y += kGrid)
    for (int x = border; x < left.width - border; x += kGrid) {
      const int d = disparity[std::size_t(y) * left.width + x];
      const int x_right = x - (d + kDisparityScale / 2) / kDisparityScale;
      if (d <= 0 || x_right < border) continue;
      std::array<int, 2 * kReach + 1> cost{};
      for (int shift = -kReach; shift <= kReach; ++shift)
        for (int v = -kHalf; v <= kHalf; ++v) {
          const std::uint8_t* a = left.pixels + (y + v) * left.stride + x;
          const std::uint8_t* b = right.pixels + (y + v + shift) * right.stride + x_right;
          for (int u = -kHalf; u <= kHalf; ++u)
            cost[std::size_t(shift + kReach)] += std::abs(a[u] - b[u]);
        }
      const auto best = std::min_element(cost.begin(), cost.end()) - cost.begin();
      if (best == 0 || best == 2 * kReach) continue;
      const int c = cost[std::size_t(best)];
      const int before = cost[std::size_t(best - 1)] - c;
      const int after = cost[std::size_t(best + 1)] - c;
      if (std::max(cost.front(), cost.back()) < kTexture * c || before + after == 0) continue;
      // Two straight lines through the three costs, as absolute differences have.
      out.push_back({x - left.width / 2., y - left.height / 2.,
                     double(best - kReach) + 0.5 * (before - after) / std::max(before, after)});
    }
  return out;
}

}  // namespace

RowError row_error(const GreyView& left, const GreyView& right,
                   std::span<const std::int16_t> disparity) {
  constexpr unsigned kEnough = 12;
  constexpr double kFirst_px = 6, kLeast_px = 0.25;  ///< what lies farther off the fit is left out
  const std::vector<RowSample> samples = measure_rows(left, right, disparity);
  RowError out;
  // From where the median is: a roll's rows lie on both sides of it.
  std::vector<double> rows;
  for (const RowSample& s : samples) rows.push_back(s.rows);
  if (rows.size() < kEnough) return out;
  const auto middle = rows.begin() + static_cast<std::ptrdiff_t>(rows.size() / 2);
  std::nth_element(rows.begin(), middle, rows.end());
  Eigen::Vector3d fit(*middle, 0, 0);
  double limit = kFirst_px;
  for (int round = 0; round < 6; ++round) {
    Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
    Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
    double squares = 0;
    unsigned count = 0;
    for (const RowSample& s : samples) {
      const Eigen::Vector3d row(1, s.x, s.y);
      const double off = s.rows - row.dot(fit);
      if (std::abs(off) > limit) continue;
      N += row * row.transpose();
      rhs += row * s.rows;
      squares += off * off;
      ++count;
    }
    if (count < kEnough) return {};
    const Eigen::Matrix3d inverse = N.inverse();
    if (!inverse.allFinite()) return {};
    fit = inverse * rhs;
    const double sigma = std::sqrt(squares / count);
    limit = std::max(kLeast_px, std::min(0.8 * limit, 3 * sigma));
    const Eigen::Vector3d sigmas = sigma * inverse.diagonal().cwiseMax(0).cwiseSqrt();
    out = {count, fit[0], sigmas[0], fit[1], sigmas[1], fit[2], sigmas[2]};
  }
  return out;
}

std::optional<double> largest_px(const RowError& e, int width, int height) {
  if (e.patches == 0) return std::nullopt;
  const double aside = std::abs(e.roll_rad) * width / 2 + std::abs(e.slope) * height / 2;
  return std::copysign(std::abs(e.offset_px) + aside, e.offset_px);
}

}  // namespace crane
