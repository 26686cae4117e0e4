// SPDX-License-Identifier: Apache-2.0
#include "motion/pattern_depth.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "motion/sweep_cells.hpp"

namespace crane {
namespace {

constexpr int kEdge = kSweepEdge;  ///< of the small images, each pixel two of the full ones
constexpr float kPixels = kEdge * kEdge;
constexpr std::size_t kMostOthers = 24;
/// The image is alike itself where the difference is at most this share of the largest: generous,
/// what is tried in vain costs only time.
constexpr double kAlike = 0.5;
constexpr int kLeastPeriod = 2;  ///< half pixels: closer, it is the same match
/// Around each depth so many steps of half a pixel (of the small image, in the longest view) are
/// tried: the pair's disparity and the crane's place are known to about that.
constexpr int kSteps = 3;
constexpr double kStep_px = 1;  ///< of the full image
/// A view bears a depth out if its difference is at most what noise gives, and this share of what
/// does not fit; one that shows clearly more contradicts.
constexpr double kNoiseShare = 1.2, kUnlikeShare = 0.25;
/// ... and what does not fit is so many times that, or the square has too little texture to tell.
constexpr double kTells = 1.5;
constexpr double kClearly = 1.5, kClearlyNoise = 0.5, kClearlyUnlike = 0.15;
constexpr int kFewestViews = 3, kMostHidden = 1, kFewestAgainst = 2;
constexpr double kSigma_px = 0.5;  ///< of a fit, in the longest view
constexpr std::size_t kMostViews = 32;

/// Mean absolute difference of a square and where it falls in another image, between its pixels.
float difference_at(const Grey& here, int x0, int y0, const Grey& there, const Eigen::Vector2d& p) {
  constexpr int kParts = 64;
  const int ix = int(p.x()), iy = int(p.y());
  const auto fx = static_cast<std::uint16_t>((p.x() - ix) * kParts);
  const auto fy = static_cast<std::uint16_t>((p.y() - iy) * kParts);
  const auto gx = static_cast<std::uint16_t>(kParts - fx),
             gy = static_cast<std::uint16_t>(kParts - fy);
  // Sixteen pixels at a time, which the compiler makes wide instructions of.
  using Row = std::array<std::uint16_t, kEdge>;
  const auto along = [&](int row, Row& out) {
    const std::uint8_t* a = there.row(iy + row) + ix;
    for (std::size_t i = 0; i < kEdge; ++i)
      out[i] = static_cast<std::uint16_t>((a[i] * gx + a[i + 1] * fx + kParts / 2) / kParts);
  };
  Row above, below;
  along(0, above);
  Row sums{};
  for (int row = 0; row < kEdge; ++row) {
    along(row + 1, below);
    const std::uint8_t* q = here.row(y0 + row) + x0;
    for (std::size_t i = 0; i < kEdge; ++i) {
      const auto v =
          static_cast<std::int16_t>((above[i] * gy + below[i] * fy + kParts / 2) / kParts);
      const auto d = static_cast<std::int16_t>(q[i] - v);
      sums[i] = static_cast<std::uint16_t>(sums[i] + (d < 0 ? -d : d));
    }
    above = below;
  }
  int sum = 0;
  for (const std::uint16_t s : sums) sum += s;
  return float(sum) / kPixels;
}

}  // namespace

/// One disparity in all views.
struct PatternDepth::Fit {
  double disparity_px = 0;  ///< the best around the one that was asked for
  double mean = 1e9;
  std::uint32_t seen = 0;                       ///< bits of views
  std::array<float, kMostViews> differences{};  ///< by view, at the best
};

bool PatternDepth::find_others(int x0, int y0, double disparity_px) {
  const Grey& g = image_.contrast;
  // right(x - d) = left(x) fits d + a as well where left(x - a) = left(x).
  const int from = int(std::floor((range_.least_px - disparity_px) / 2));
  const int to = int(std::ceil((range_.most_px - disparity_px) / 2));
  others_.assign(1, 0.0);
  if (from > 0 || to < 0) return false;
  offsets_.resize(std::size_t(to - from + 1));
  costs_.resize(offsets_.size());
  for (int a = from; a <= to; ++a) {
    const int x = x0 - a;
    offsets_[std::size_t(a - from)] = x >= 0 && x + kEdge <= g.width ? y0 * g.width + x : -1;
  }
  sweep_cell(
      {g.row(y0) + x0, g.width, g.pixels.data(), g.width, offsets_.data(), int(offsets_.size())},
      costs_.data());
  int most = 0;
  for (const std::uint16_t c : costs_)
    if (c != kNotVisible) most = std::max(most, int(c));
  unlike_ = most * 2 / double(kPixels);
  const int count = int(costs_.size());
  double period = 0;  // the least
  for (int i = 0; i < count; ++i) {
    const int a = i + from;
    if (costs_[std::size_t(i)] == kNotVisible || std::abs(a) < kLeastPeriod ||
        costs_[std::size_t(i)] > kAlike * most)
      continue;
    const auto cost = [&](int k) {
      return k < 0 || k >= count ? int(kNotVisible) : int(costs_[std::size_t(k)]);
    };
    if (cost(i - 1) < cost(i) || cost(i + 1) <= cost(i)) continue;
    others_.push_back(2.0 * a);
    if (period == 0 || std::abs(a) < period) period = std::abs(a);
  }
  // What lies outside the image goes on as it does inside.
  for (int i = 0; i < count; ++i) {
    if (costs_[std::size_t(i)] != kNotVisible) continue;
    if (period == 0) return false;
    const int a = i + from;
    if (std::abs(std::remainder(double(a), period)) < 0.5) others_.push_back(2.0 * a);
  }
  return others_.size() <= kMostOthers;
}

bool PatternDepth::inside(const Grey& there, const Eigen::Vector2d& p) {
  return p.x() >= 0 && p.y() >= 0 && p.x() < there.width - kEdge - 1 &&
         p.y() < there.height - kEdge - 1;
}

std::optional<Eigen::Vector2d> PatternDepth::place(int x0, int y0, double disparity_px,
                                                   const MotionView& view) const {
  const double mu = 2 * (x0 + (kEdge - 1) / 2.0) + 0.5, mv = 2 * (y0 + (kEdge - 1) / 2.0) + 0.5;
  const Eigen::Vector3d ray((mu - image_.cx_px) / image_.f_px, (mv - image_.cy_px) / image_.f_px,
                            1);
  const Eigen::Vector3d q = view.warp.R * ray + disparity_px / range_.fb * view.warp.t;
  if (!(q.z() > 0.1)) return std::nullopt;
  return Eigen::Vector2d(
      ((q.x() / q.z() * image_.f_px + image_.cx_px) - 0.5) / 2 - (kEdge - 1) / 2.0,
      ((q.y() / q.z() * image_.f_px + image_.cy_px) - 0.5) / 2 - (kEdge - 1) / 2.0);
}

double PatternDepth::step_px() const {
  return kStep_px * range_.fb / (image_.f_px * set_.longest_m);
}

double PatternDepth::borne_out() const {
  return kNoiseShare * set_.noise_grey + kUnlikeShare * unlike_;
}

PatternDepth::Fit PatternDepth::fit(int x0, int y0, double disparity_px) const {
  Fit out;
  out.disparity_px = disparity_px;
  std::array<float, kMostViews> differences;
  for (int j = -kSteps; j <= kSteps; ++j) {
    const double tried = disparity_px + j * step_px();
    if (!(tried > 0)) continue;
    std::uint32_t seen = 0;
    double sum = 0;
    for (std::size_t k = 0; k < set_.views.size(); ++k) {
      const MotionView& view = set_.views[k];
      const auto at = place(x0, y0, tried, view);
      if (!at || !inside(view.image->contrast, *at)) continue;
      const float d = difference_at(image_.contrast, x0, y0, view.image->contrast, *at);
      differences[k] = d;
      sum += d;
      seen |= 1U << k;
    }
    out.seen |= seen;
    if (seen == 0 || sum / __builtin_popcount(seen) >= out.mean) continue;
    out.mean = sum / __builtin_popcount(seen);
    out.disparity_px = tried;
    out.differences = differences;
  }
  return out;
}

/// If another disparity were true, a view would show at the place of `best` what lies beside the
/// square on that surface. So it contradicts by what it shows at the other's place, or, not seeing
/// that, if what lies beside the square is unlike it.
bool PatternDepth::contradicts(int x0, int y0, double other_px, const Fit& best, std::size_t view,
                               double limit) const {
  bool seen = false;
  for (int j = -kSteps; j <= kSteps; ++j) {
    const auto at = place(x0, y0, other_px + j * step_px(), set_.views[view]);
    const Grey& there = set_.views[view].image->contrast;
    if (!at || !inside(there, *at)) continue;
    seen = true;
    if (difference_at(image_.contrast, x0, y0, there, *at) <= limit) return false;
  }
  if (seen || (best.seen >> view & 1U) == 0) return seen;
  const auto a = place(x0, y0, best.disparity_px, set_.views[view]);
  const auto b = place(x0, y0, other_px, set_.views[view]);
  if (!a || !b) return false;
  const Eigen::Vector2d beside = Eigen::Vector2d(x0, y0) + *a - *b;
  return inside(image_.contrast, beside) &&
         difference_at(image_.contrast, x0, y0, image_.contrast, beside) > limit;
}

/// The views that bear it out; none if they are too few, or too many see something else.
std::uint32_t PatternDepth::bearing(const Fit& fit) const {
  std::uint32_t out = 0;
  int against = 0;
  for (std::size_t k = 0; k < set_.views.size(); ++k) {
    if ((fit.seen >> k & 1U) == 0) continue;
    if (fit.differences[k] <= borne_out() && kTells * fit.differences[k] <= unlike_)
      out |= 1U << k;
    else
      ++against;
  }
  return against > kMostHidden || __builtin_popcount(out) < kFewestViews ? 0 : out;
}

std::optional<CellFit> PatternDepth::choose(int u, int v, double disparity_px) {
  const Grey& here = image_.contrast;
  const int x0 = u / 2 - kEdge / 2, y0 = v / 2 - kEdge / 2;
  if (set_.views.size() < std::size_t(kFewestViews) || x0 < 0 || y0 < 0 ||
      x0 + kEdge > here.width || y0 + kEdge > here.height || !find_others(x0, y0, disparity_px))
    return std::nullopt;
  // The first that is borne out: if there is another one, that will not be contradicted.
  Fit best;
  std::uint32_t views = 0;
  std::size_t chosen = 0;
  for (std::size_t i = 0; i < others_.size() && views == 0; ++i) {
    best = fit(x0, y0, disparity_px + others_[i]);
    views = bearing(best);
    chosen = i;
  }
  if (views == 0) return std::nullopt;
  for (std::size_t i = 0; i < others_.size(); ++i) {
    if (i == chosen) continue;
    int against = 0;
    for (std::size_t k = 0; k < set_.views.size() && against < kFewestAgainst; ++k) {
      const double fits_here = (views >> k & 1U) != 0 ? best.differences[k] : borne_out();
      const double limit =
          kClearly * fits_here + kClearlyNoise * set_.noise_grey + kClearlyUnlike * unlike_;
      against += contradicts(x0, y0, disparity_px + others_[i], best, k, limit) ? 1 : 0;
    }
    if (against < kFewestAgainst) return std::nullopt;
  }
  return CellFit{best.disparity_px / range_.fb, kSigma_px / (image_.f_px * set_.longest_m), views,
                 __builtin_popcount(views)};
}

}  // namespace crane
