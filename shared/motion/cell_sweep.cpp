// SPDX-License-Identifier: Apache-2.0
#include "motion/cell_sweep.hpp"

#include <algorithm>
#include <cmath>

#include "motion/sweep_cells.hpp"

namespace crane {
namespace {

constexpr double kStep_px = 2;
constexpr int kMostHypotheses = 256;
constexpr std::size_t kMostCandidates = 10;
constexpr float kPixels = kSweepEdge * kSweepEdge;
/// Of a sum of absolute differences, a pixel: what noise gives in the small images (means of four,
/// both noisy), with interpolation and half a step of error.
constexpr float kNoiseShare = 0.6F, kStepShare = 0.25F;
/// What is worse than the best by this factor, so much noise, and half a pixel of slip, is worse.
constexpr float kClearly = 1.35F, kClearlyNoise = 0.35F, kSlipShare = 0.5F;
/// A view tells depths apart if its worst is so many times its best.
constexpr float kTells = 2.0F;
constexpr float kUnseen = 1e6F;
constexpr double kUntested = 0.1;
constexpr int kBeside = 2;  ///< hypotheses around the best that are the same

}  // namespace

Hypotheses hypotheses_for(const PlacedImage& image, const ViewSet& set, double nearest_m,
                          double farthest_m) {
  Hypotheses out;
  if (!(set.longest_m > 0)) return out;
  out.first = 1 / farthest_m;
  const double range = 1 / nearest_m - out.first;
  out.step = kStep_px / (image.f_px * set.longest_m);
  out.count = static_cast<int>(std::ceil(range / out.step)) + 1;
  if (out.count > kMostHypotheses) {
    out.count = kMostHypotheses;
    out.step = range / (kMostHypotheses - 1);
  }
  return out;
}

CellSweep::CellSweep(const PlacedImage& image, const ViewSet& set, const Hypotheses& hypotheses)
    : image_(image),
      set_(set),
      hypotheses_(hypotheses),
      offsets_(std::size_t(hypotheses.count)),
      costs_(set.views.size() * std::size_t(hypotheses.count)),
      sum_(std::size_t(hypotheses.count)),
      seen_(std::size_t(hypotheses.count)) {}

bool CellSweep::measure(int x0, int y0) {
  const Grey& here = image_.contrast;
  const auto count = std::size_t(hypotheses_.count);
  const double mu = 2 * (x0 + (kSweepEdge - 1) / 2.0) + 0.5;
  const double mv = 2 * (y0 + (kSweepEdge - 1) / 2.0) + 0.5;
  const Eigen::Vector3d ray((mu - image_.cx_px) / image_.f_px, (mv - image_.cy_px) / image_.f_px,
                            1);
  std::fill(sum_.begin(), sum_.end(), 0.0F);
  std::fill(seen_.begin(), seen_.end(), std::uint8_t{0});
  for (std::size_t k = 0; k < set_.views.size(); ++k) {
    const MotionView& view = set_.views[k];
    const Grey& there = view.image->contrast;
    const Eigen::Vector3d from = view.warp.R * ray;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d q = from + hypotheses_.at(double(i)) * view.warp.t;
      offsets_[i] = -1;
      if (!(q.z() > 0.1)) continue;
      const double at_x = ((q.x() / q.z() * image_.f_px + image_.cx_px) - 0.5) / 2;
      const double at_y = ((q.y() / q.z() * image_.f_px + image_.cy_px) - 0.5) / 2;
      const double x = at_x - (kSweepEdge - 1) / 2.0 + 0.5, y = at_y - (kSweepEdge - 1) / 2.0 + 0.5;
      if (!(x >= 0 && y >= 0 && x < there.width - kSweepEdge + 1 &&
            y < there.height - kSweepEdge + 1))
        continue;
      offsets_[i] = int(y) * there.width + int(x);
    }
    std::uint16_t* costs = costs_.data() + k * count;
    sweep_cell({here.row(y0) + x0, here.width, there.pixels.data(), there.width, offsets_.data(),
                static_cast<int>(count)},
               costs);
    for (std::size_t i = 0; i < count; ++i)
      if (costs[i] != kNotVisible) sum_[i] += float(costs[i]) * 2 / kPixels, ++seen_[i];
  }
  std::size_t untested = 0;
  for (std::size_t i = 0; i < count; ++i) {
    untested += seen_[i] == 0 ? 1 : 0;
    sum_[i] = seen_[i] == 0 ? kUnseen : sum_[i] / float(seen_[i]);
  }
  // What no view sees cannot be ruled out.
  return double(untested) <= kUntested * double(count);
}

float CellSweep::slip_at(int x0, int y0) const {
  const Grey& g = image_.contrast;
  if (x0 + 1 + kSweepEdge > g.width || y0 + 1 + kSweepEdge > g.height) return 0;
  const std::int32_t beside[2] = {1, g.width};
  std::uint16_t costs[2];
  const std::uint8_t* here = g.row(y0) + x0;
  sweep_cell({here, g.width, here, g.width, beside, 2}, costs);
  return kSlipShare * float(costs[0] + costs[1]) * 2 / kPixels;
}

CellCandidate CellSweep::candidate(std::size_t at) const {
  const auto count = std::size_t(hypotheses_.count);
  const auto noise = static_cast<float>(set_.noise_grey);
  CellCandidate out;
  out.cost = sum_[at];
  for (std::size_t k = 0; k < set_.views.size(); ++k) {
    const std::uint16_t* costs = costs_.data() + k * count;
    if (costs[at] == kNotVisible) continue;
    out.visible |= 1U << k;
    float least = kUnseen;
    float most = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (costs[i] == kNotVisible) continue;
      const float c = float(costs[i]) * 2 / kPixels;
      if (i + 1 >= at && i <= at + 1) least = std::min(least, c);
      most = std::max(most, c);
    }
    if (least > kNoiseShare * 2 * noise + kStepShare * most || most < kTells * least) continue;
    out.bearing |= 1U << k;
  }
  double shift = 0;
  if (at > 0 && at + 1 < count && sum_[at - 1] < kUnseen && sum_[at + 1] < kUnseen) {
    const double a = sum_[at - 1], b = sum_[at], c = sum_[at + 1];
    if (a + c - 2 * b > 1e-6) shift = std::clamp(0.5 * (a - c) / (a + c - 2 * b), -0.5, 0.5);
  }
  out.inverse_m = hypotheses_.at(double(at) + shift);
  return out;
}

const std::vector<CellCandidate>& CellSweep::look(int u, int v) {
  found_.clear();
  const Grey& here = image_.contrast;
  const int x0 = u / 2 - kSweepEdge / 2, y0 = v / 2 - kSweepEdge / 2;
  if (x0 < 0 || y0 < 0 || x0 + kSweepEdge > here.width || y0 + kSweepEdge > here.height ||
      !measure(x0, y0))
    return found_;
  const auto best = std::size_t(std::min_element(sum_.begin(), sum_.end()) - sum_.begin());
  if (sum_[best] >= kUnseen) return found_;
  const float limit =
      sum_[best] * kClearly + kClearlyNoise * float(set_.noise_grey) + slip_at(x0, y0);
  found_.push_back(candidate(best));
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    if (i == best || sum_[i] > limit) continue;
    // Of its surroundings the lowest.
    bool lowest = true;
    for (std::size_t k = std::max(i, std::size_t{kBeside}) - kBeside;
         k <= std::min(i + kBeside, sum_.size() - 1); ++k)
      lowest &= sum_[k] > sum_[i] || (sum_[k] == sum_[i] && k >= i);
    if (!lowest) continue;
    found_.push_back(candidate(i));
    if (found_.size() > kMostCandidates) {
      found_.clear();
      break;
    }
  }
  return found_;
}

}  // namespace crane
