// SPDX-License-Identifier: Apache-2.0
#include "motion/cell_proof.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

constexpr int kRounds = 4;
constexpr double kConverged_px = 0.1;
/// A candidate is right up to this misfit, and another one wrong from that, and so many times the
/// best one's.
constexpr double kRight = 2.5, kWrong = 3, kWrongTimes = 2, kHopeless = 12;
/// Of the differences of two images, in what noise gives: borne out up to here, likely up to there.
constexpr float kBorneOut = 2.2F, kAlmost = 7;
constexpr double kMostSigmas = 4;  ///< by which the pair may be wrong
constexpr double kSame_px = 1.5;   ///< closer, two candidates are one
constexpr float kSlip_px = 0.3F;   ///< error of a good depth, in the image
constexpr float kTextured = 5;     ///< sum of squared gradients in 3 x 3, in what noise gives
constexpr double kBias_px = 0.06;  ///< what is left of interpolation
constexpr double kCorrelated = 2;  ///< neighbours share noise of interpolation and texture
constexpr int kFewestViews = 3;    ///< beside the newest image
constexpr int kMostHidden = 1;     ///< views that may show something else

}  // namespace

bool CellProof::take_window(int u0, int v0) {
  const Grey& g = image_.full;
  const int x0 = u0 - kMargin, y0 = v0 - kMargin;
  if (x0 < 1 || y0 < 1 || x0 + kWindow >= g.width || y0 + kWindow >= g.height) return false;
  for (int y = 0; y < kWindow; ++y) {
    const std::uint8_t* p = g.row(y0 + y) + x0;
    const std::uint8_t* above = p - g.width;
    const std::uint8_t* below = p + g.width;
    float* to = here_.data() + y * kWindow;
    float* gx = gx_.data() + y * kWindow;
    float* gy = gy_.data() + y * kWindow;
    for (int x = 0; x < kWindow; ++x) {
      to[x] = float(p[x]);
      gx[x] = 0.5F * float(p[x + 1] - p[x - 1]);
      gy[x] = 0.5F * float(below[x] - above[x]);
    }
  }
  return true;
}

std::optional<CellProof::Place> CellProof::place(int u0, int v0, double inverse_m,
                                                 const MotionView& view) const {
  const double mu = u0 + (kCellEdge - 1) / 2.0, mv = v0 + (kCellEdge - 1) / 2.0;
  const Eigen::Vector3d ray((mu - image_.cx_px) / image_.f_px, (mv - image_.cy_px) / image_.f_px,
                            1);
  const Eigen::Vector3d q = view.warp.R * ray + inverse_m * view.warp.t;
  if (!(q.z() > 0.1)) return std::nullopt;
  const double x = q.x() / q.z() * image_.f_px + image_.cx_px - (kWindow - 1) / 2.0;
  const double y = q.y() / q.z() * image_.f_px + image_.cy_px - (kWindow - 1) / 2.0;
  const Grey& there = view.image->full;
  if (!(x >= 0 && y >= 0 && x < there.width - kWindow - 1 && y < there.height - kWindow - 1))
    return std::nullopt;
  const Eigen::Vector3d& t = view.warp.t;
  Place out;
  out.motion = image_.f_px / q.z() *
               Eigen::Vector2d(t.x() - q.x() / q.z() * t.z(), t.y() - q.y() / q.z() * t.z());
  out.x = int(x), out.y = int(y);
  out.fx = float(x - out.x), out.fy = float(y - out.y);
  return out;
}

WindowDifference CellProof::compare(const MotionView& view, const Place& place) {
  const Grey& there = view.image->full;
  const float mean = window_difference(here_.data(), there.row(place.y) + place.x, there.width,
                                       place.fx, place.fy, difference_.data());
  return {gx_.data(), gy_.data(), difference_.data(), mean,
          static_cast<float>(2 * set_.noise_grey * set_.noise_grey)};
}

std::optional<CellFit> CellProof::decide(int u0, int v0,
                                         const std::vector<CellCandidate>& candidates) {
  if (candidates.empty() || !take_window(u0, v0)) return std::nullopt;
  std::optional<CellFit> best;
  double least = kRight;
  std::vector<std::pair<double, double>> all;  // inverse depth, misfit
  for (const CellCandidate& c : candidates) {
    const auto close = refine(u0, v0, c.inverse_m, c.visible);
    const double at = close ? close->inverse_m : c.inverse_m;
    // One that could not be brought to its best is not ruled out by what it looks like.
    const double half = close ? 1 : 0.5;
    int against = 0;
    const double left = half * misfit(u0, v0, at, c.visible, &against);
    // One view alone may look at something that hides it.
    all.emplace_back(at, against > kMostHidden ? left : 0);
    if (__builtin_popcount(c.bearing) < kFewestViews ||
        __builtin_popcount(c.visible & ~c.bearing) > kMostHidden)
      continue;
    const auto fit = refine(u0, v0, c.inverse_m, c.bearing);
    if (!fit || fit->count < kFewestViews) continue;
    const double remains = misfit(u0, v0, fit->inverse_m, fit->views);
    if (remains >= least) continue;
    least = remains;
    best = fit;
  }
  if (!best) return std::nullopt;
  const double longest = set_.longest_m * image_.f_px;
  for (const auto& [at, left] : all) {
    if (std::abs(at - best->inverse_m) * longest < kSame_px) continue;
    if (left < std::max(kWrong, kWrongTimes * least)) return std::nullopt;
  }
  return best;
}

std::uint32_t CellProof::seen_by(int u0, int v0, double inverse_m) {
  std::uint32_t out = 0;
  for (std::size_t k = 0; k < set_.views.size(); ++k)
    if (place(u0, v0, inverse_m, set_.views[k])) out |= 1U << k;
  return out;
}

std::optional<CellFit> CellProof::sharpen(int u0, int v0, double inverse_m, double sigma,
                                          std::uint32_t views) {
  if (!take_window(u0, v0)) return std::nullopt;
  auto fit = refine(u0, v0, inverse_m, views);
  if (!fit || fit->count == 0 || std::abs(fit->inverse_m - inverse_m) > kMostSigmas * sigma ||
      misfit(u0, v0, fit->inverse_m, fit->views) > kRight)
    return std::nullopt;
  return fit;
}

double CellProof::misfit(int u0, int v0, double inverse_m, std::uint32_t views, int* against) {
  double sum = 0;
  int seen = 0;
  for (std::size_t k = 0; k < set_.views.size(); ++k) {
    if ((views >> k & 1U) == 0) continue;
    const auto at = place(u0, v0, inverse_m, set_.views[k]);
    if (!at) continue;
    const auto left = double(window_misfit(compare(set_.views[k], *at), kSlip_px));
    sum += std::min(kHopeless, left);
    if (against != nullptr && left > kWrong) ++*against;
    ++seen;
  }
  return seen > 0 ? sum / seen : 0;
}

std::optional<CellFit> CellProof::refine(int u0, int v0, double inverse_m, std::uint32_t views) {
  CellFit out{inverse_m, 0, views, 0};
  double step_px = 0;
  double gradients = 0;
  double longest_px = 0;
  double position = 0;
  for (int round = 0; round < kRounds; ++round) {
    double numerator = 0;
    gradients = longest_px = 0;
    for (std::size_t k = 0; k < set_.views.size(); ++k) {
      if ((views >> k & 1U) == 0) continue;
      const auto at = place(u0, v0, out.inverse_m, set_.views[k]);
      if (!at) {
        if (round > 0) return std::nullopt;
        out.views &= ~(1U << k);
        continue;
      }
      if ((out.views >> k & 1U) == 0) continue;
      const WindowSums sums =
          window_sums(compare(set_.views[k], *at), float(at->motion.x()), float(at->motion.y()));
      numerator += double(sums.gr);
      gradients += double(sums.gg);
      longest_px = std::max(longest_px, at->motion.norm());
      position = std::max(position, set_.views[k].sigma_m / set_.views[k].displacement_m.norm());
    }
    if (!(gradients > 0) || !(longest_px > 0)) return std::nullopt;
    const double change = numerator / gradients;
    step_px = std::abs(change) * longest_px;
    if (step_px > 2) return std::nullopt;
    out.inverse_m += change;
    if (step_px < kConverged_px / 2) break;
  }
  if (step_px > kConverged_px || std::abs(out.inverse_m - inverse_m) * longest_px > 3)
    return std::nullopt;
  out.count = __builtin_popcount(out.views);
  const double noise = 2 * set_.noise_grey * set_.noise_grey;
  const double random = std::sqrt(kCorrelated * noise / gradients);
  const double bias = kBias_px / longest_px;
  const double placed = position * out.inverse_m;
  out.sigma = std::sqrt(random * random + bias * bias + placed * placed);
  return out;
}

void CellProof::look(int u0, int v0, const CellFit& fit,
                     std::array<Borne, kCellEdge * kCellEdge>& out) {
  out.fill(Borne::kNot);
  if (!take_window(u0, v0)) return;
  constexpr std::size_t kAll = kWindow * kWindow;
  const auto noise = static_cast<float>(2 * set_.noise_grey * set_.noise_grey);
  std::array<float, kAll> square{};
  std::array<float, kAll> worst{}, gradient{};
  for (std::size_t k = 0; k < set_.views.size(); ++k) {
    if ((fit.views >> k & 1U) == 0) continue;
    const auto at = place(u0, v0, fit.inverse_m, set_.views[k]);
    if (!at) return;
    (void)compare(set_.views[k], *at);
    // The usual difference of brightness: the median of rough steps.
    std::array<float, kAll> sorted = difference_;
    std::nth_element(sorted.begin(), sorted.begin() + kAll / 2, sorted.end());
    const float usual = sorted[kAll / 2];
    const Eigen::Vector2d along = at->motion.normalized();
    const auto mx = static_cast<float>(along.x()), my = static_cast<float>(along.y());
    for (std::size_t i = 0; i < kAll; ++i) {
      const float d = difference_[i] - usual;
      const float g = gx_[i] * mx + gy_[i] * my;
      // The place is uncertain across the way as well.
      const float edge = gx_[i] * gx_[i] + gy_[i] * gy_[i];
      square[i] = d * d / (noise + kSlip_px * kSlip_px * edge);
      gradient[i] = std::max(gradient[i], g * g);
    }
    for (int y = kMargin; y < kMargin + kCellEdge; ++y)
      for (int x = kMargin; x < kMargin + kCellEdge; ++x) {
        float sum = 0;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) sum += square[std::size_t((y + dy) * kWindow + x + dx)];
        float& most = worst[std::size_t(y * kWindow + x)];
        most = std::max(most, sum / 9);
      }
  }
  for (int y = 0; y < kCellEdge; ++y)
    for (int x = 0; x < kCellEdge; ++x) {
      const auto i = std::size_t((y + kMargin) * kWindow + x + kMargin);
      Borne& borne = out[std::size_t(y * kCellEdge + x)];
      if (worst[i] > kAlmost) continue;
      borne = Borne::kLikely;
      if (worst[i] > kBorneOut) continue;
      float sum = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) sum += gradient[std::size_t(int(i) + dy * kWindow + dx)];
      // A central difference has half the variance of one pixel's noise.
      borne = sum > kTextured * 9 * noise / 4 ? Borne::kTextured : Borne::kPlain;
    }
}

}  // namespace crane
