// SPDX-License-Identifier: Apache-2.0
#include "motion/bar_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace crane {
namespace {

constexpr int kFewestViews = 3;  ///< beside the newest image
/// Of the range of depths the least displacement across the rows in the farthest view [px].
constexpr double kLeastWay_px = 16;
/// A view is from beside if it is so far across the rows, of the farthest.
constexpr double kBeside = 0.3;
/// As for all views (views.cpp), across the rows.
constexpr double kUnsteady = 0.15;
constexpr int kAround = 8;  ///< rows of background beside a band
/// A bar's depth explains it clearly better than any other: of their mean differences.
constexpr double kClearly = 0.75;
constexpr double kRowClearly = 0.8;  ///< and each of its rows, than the background
constexpr int kFewestRows = 2;
constexpr double kFromWithin_px = 3;  ///< that rows within a bar may be wrong by
constexpr double kLeast_grey = 2;     ///< differences below tell nothing
constexpr int kMostMinima = 4;
constexpr double kSame_px = 2;  ///< nearer, two depths are one
constexpr double kSigma_px = 0.35;
constexpr int kSlope = 1;  ///< rows from a piece to the next
constexpr double kGoesOn = 0.85;

}  // namespace

BarSweep::BarSweep(const PlacedImage& image, const ViewSet& set, double nearest_m)
    : image_(image), nearest_inverse_(1 / nearest_m) {
  for (const MotionView& v : set.views) longest_m_ = std::max(longest_m_, std::abs(v.warp.t.y()));
  double tt = 0, td = 0;
  for (const MotionView& v : set.views) {
    if (!(std::abs(v.warp.t.y()) > kBeside * longest_m_)) continue;
    views_.push_back({&v});
    position_ = std::max(position_, v.sigma_m / v.displacement_m.norm());
    const double t = double(image.exposure - v.image->exposure) * 1e-9;
    tt += t * t;
    td += t * v.warp.t.y();
  }
  if (int(views_.size()) < kFewestViews) return;
  for (const View& v : views_) {
    const double t = double(image.exposure - v.view->image->exposure) * 1e-9;
    can_tell_ |= std::abs(v.view->warp.t.y() - td / tt * t) > kUnsteady * longest_m_;
  }
}

std::optional<BarSweep::Point> BarSweep::place(const MotionView& view, int u, int v,
                                               double inverse_m) const {
  const Eigen::Vector3d ray((u - image_.cx_px) / image_.f_px, (v - image_.cy_px) / image_.f_px, 1);
  const Eigen::Vector3d q = view.warp.R * ray + inverse_m * view.warp.t;
  if (!(q.z() > 0.1)) return std::nullopt;
  return Point{q.x() / q.z() * image_.f_px + image_.cx_px,
               q.y() / q.z() * image_.f_px + image_.cy_px};
}

bool BarSweep::take_offsets(int v0, int v1) {
  const Grey& here = image_.full;
  int see = 0;
  for (View& view : views_) {
    const Grey& there = view.view->image->full;
    view.sees = false;
    double sum = 0;
    int n = 0;
    for (const int v : {v0 - kAround, v1}) {
      const auto at = place(*view.view, u_, v, background_);
      if (!at) continue;
      const int x = int(std::lround(at->x)), y = int(std::lround(at->y));
      if (x < 0 || y < 0 || x + width_ > there.width || y + kAround > there.height) continue;
      for (int row = 0; row < kAround; ++row)
        for (int c = 0; c < width_; ++c)
          sum += double(there.row(y + row)[x + c]) - double(here.row(v + row)[u_ + c]);
      n += kAround * width_;
    }
    if (n == 0) continue;
    view.offset = float(sum / n);
    view.sees = true;
    ++see;
  }
  return see >= kFewestViews;
}

void BarSweep::measure() {
  const Grey& here = image_.full;
  sum_.assign(std::size_t(steps_) * std::size_t(rows_), 0);
  seen_.assign(std::size_t(steps_), 0);
  std::array<std::uint8_t, std::size_t(kMostRows) * kWidth> brightness;
  for (const View& view : views_) {
    if (!view.sees) continue;
    for (int row = 0; row < rows_; ++row)
      for (int c = 0; c < kWidth; ++c)
        brightness[std::size_t(row * kWidth + c)] = static_cast<std::uint8_t>(
            std::clamp(float(here.row(first_ + row)[u_ + c]) + view.offset, 0.0F, 255.0F));
    const Grey& there = view.view->image->full;
    for (int i = 0; i < steps_; ++i) {
      const auto at = place(*view.view, u_, first_, background_ + i * step_);
      if (!at) continue;
      const int x = int(std::lround(at->x)), y = int(std::lround(at->y));
      if (x < 0 || y < 0 || x + kWidth > there.width || y + rows_ > there.height) continue;
      ++seen_[std::size_t(i)];
      float* sum = sum_.data() + std::size_t(i) * std::size_t(rows_);
      for (int row = 0; row < rows_; ++row) {
        const std::uint8_t* a = brightness.data() + row * kWidth;
        const std::uint8_t* b = there.row(y + row) + x;
        int apart = 0;
        for (int c = 0; c < kWidth; ++c) apart += std::abs(int(a[c]) - int(b[c]));
        sum[row] += float(apart);
      }
    }
  }
  for (int i = 0; i < steps_; ++i)
    for (int row = 0; row < rows_; ++row)
      sum_[std::size_t(i) * std::size_t(rows_) + std::size_t(row)] /=
          float(std::max<int>(1, seen_[std::size_t(i)]) * kWidth);
}

double BarSweep::cost(int v, int half, double inverse_m, int* views) const {
  double sum = 0;
  int seen = 0;
  for (const View& view : views_) {
    if (!view.sees) continue;
    const auto at = place(*view.view, u_, v - half, inverse_m);
    if (!at) continue;
    const Grey& there = view.view->image->full;
    const int x = int(std::floor(at->x)), y = int(std::floor(at->y));
    if (x < 0 || y < 0 || x + width_ >= there.width || y + 2 * half + 1 >= there.height) continue;
    const auto fx = float(at->x - x), fy = float(at->y - y);
    float apart = 0;
    for (int row = 0; row <= 2 * half; ++row) {
      const std::uint8_t* a = image_.full.row(v - half + row) + u_;
      const std::uint8_t* b = there.row(y + row) + x;
      const std::uint8_t* below = there.row(y + row + 1) + x;
      for (int c = 0; c < width_; ++c) {
        const float upper = float(b[c]) + fx * float(b[c + 1] - b[c]);
        const float lower = float(below[c]) + fx * float(below[c + 1] - below[c]);
        apart += std::abs(float(a[c]) + view.offset - upper - fy * (lower - upper));
      }
    }
    sum += double(apart) / (width_ * (2 * half + 1));
    ++seen;
  }
  if (views != nullptr) *views = seen;
  return seen > 0 ? sum / seen : 1e9;
}

std::pair<double, double> BarSweep::closest(int v, int half, double inverse_m, double steps) const {
  std::pair<double, double> least{1e9, inverse_m};
  const int quarters = static_cast<int>(std::lround(4 * steps));
  for (int k = -quarters; k <= quarters; ++k) {
    const double w = inverse_m + 0.25 * k * step_;
    least = std::min(least, {cost(v, half, w), w});
  }
  return least;
}

std::optional<BarFit> BarSweep::look(const BarBand& band) {
  const Grey& here = image_.full;
  width_ = kWidth;
  u_ = band.u0 + kBarPiece / 2 - kWidth / 2;
  if (u_ < 0 || u_ + kWidth > here.width || band.v0 < kAround || band.v1 + kAround > here.height)
    return std::nullopt;
  first_ = band.v0 - kHalf;
  rows_ = band.v1 - band.v0 + 2 * kHalf;
  background_ = 1 / double(band.background_m);
  const double range = nearest_inverse_ - background_;
  step_ = 1 / (image_.f_px * longest_m_);
  if (rows_ > kMostRows || range < kLeastWay_px * step_ || !take_offsets(band.v0, band.v1))
    return std::nullopt;
  step_ = std::max(step_, range / (kMostSteps - 1));
  steps_ = int(range / step_) + 1;
  measure();
  // The row whose best depth is the clearest.
  const auto strip = [&](int i, int row) {  // rows row .. row + kHeight
    const float* sum = sum_.data() + std::size_t(i) * std::size_t(rows_) + row;
    return std::accumulate(sum, sum + kHeight, 0.0F) / kHeight;
  };
  int best_row = -1, best = 0;
  double clearest = kClearly + 0.1;
  std::vector<float> costs(static_cast<std::size_t>(steps_));
  const int same = int(std::ceil(kSame_px * (1 / (image_.f_px * longest_m_)) / step_)) + 1;
  for (int row = 0; row + kHeight <= rows_; ++row) {
    int least = -1;
    for (int i = 0; i < steps_; ++i) {
      costs[std::size_t(i)] = strip(i, row);
      if (seen_[std::size_t(i)] >= kFewestViews &&
          (least < 0 || costs[std::size_t(i)] < costs[std::size_t(least)]))
        least = i;
    }
    if (least <= same) continue;  // the background
    float other = 1e9F;
    for (int i = 0; i < steps_; ++i)
      if (std::abs(i - least) > same && seen_[std::size_t(i)] > 0)
        other = std::min(other, costs[std::size_t(i)]);
    if (other < kLeast_grey) continue;
    const double ratio = double(costs[std::size_t(least)]) / double(other);
    if (ratio < clearest) clearest = ratio, best_row = row, best = least;
  }
  if (best_row < 0) return std::nullopt;
  // Whole pixels can make an alias look better: the lowest ones are compared between pixels.
  for (int i = 0; i < steps_; ++i) costs[std::size_t(i)] = strip(i, best_row);
  const int middle = first_ + best_row + kHalf;
  const auto [left, inverse_m] = closest(middle, kHalf, background_ + best * step_);
  std::vector<std::pair<float, int>> minima = {{0.0F, 0}};  // the background always
  for (int i = 1; i < steps_; ++i)
    if (std::abs(i - best) > same && costs[std::size_t(i)] <= costs[std::size_t(i - 1)] &&
        (i + 1 == steps_ || costs[std::size_t(i)] < costs[std::size_t(i + 1)]))
      minima.emplace_back(costs[std::size_t(i)], i);
  std::sort(minima.begin(), minima.end());
  minima.resize(std::min<std::size_t>(minima.size(), kMostMinima + 1));
  for (const auto& [unused, i] : minima)
    if (left > kClearly * closest(middle, kHalf, background_ + i * step_).first)
      return std::nullopt;
  int views = 0;
  cost(middle, kHalf, inverse_m, &views);
  if (views < kFewestViews) return std::nullopt;
  BarFit out{inverse_m, 0, 0, 0, band.background_m, 1 / (image_.f_px * longest_m_)};
  if (!take_rows(band, out)) return std::nullopt;
  // Within a plain bar all rows are alike: its edges tell its depth.
  const int half = std::min((out.v1 - out.v0) / 2 + 1, kAround);
  out.inverse_m =
      closest((out.v0 + out.v1 - 1) / 2, half, inverse_m, kFromWithin_px * out.step / step_).second;
  if (!take_rows(band, out)) return std::nullopt;
  const double placed = position_ * inverse_m, seen = kSigma_px * out.step;
  out.sigma = std::sqrt(placed * placed + seen * seen);
  return out;
}

bool BarSweep::take_rows(const BarBand& band, BarFit& bar) const {
  bar.v0 = bar.v1 = 0;
  for (int v = band.v0; v < band.v1; ++v) {
    if (cost(v, 0, bar.inverse_m) > kRowClearly * cost(v, 0, background_)) continue;
    if (bar.v1 == 0) bar.v0 = v;
    bar.v1 = v + 1;
  }
  return bar.v1 - bar.v0 >= kFewestRows;
}

std::optional<BarFit> BarSweep::follow(const BarFit& bar, int u0) {
  u_ = u0;
  width_ = kBarPiece;
  step_ = bar.step;
  background_ = 1 / double(bar.background_m);
  if (u_ < 0 || u_ + width_ > image_.full.width || bar.v0 < kAround + kSlope ||
      bar.v1 + kAround + kSlope > image_.full.height || !take_offsets(bar.v0, bar.v1))
    return std::nullopt;
  const int half = std::clamp((bar.v1 - bar.v0 - 1) / 2, 1, 3);
  std::optional<BarFit> out;
  double least = kGoesOn;
  for (const int slope : {0, -kSlope, kSlope}) {
    const int v = (bar.v0 + bar.v1 - 1) / 2 + slope;
    const double background = closest(v, half, background_).first;
    const auto [left, inverse_m] = closest(v, half, bar.inverse_m);
    int views = 0;
    cost(v, half, inverse_m, &views);
    if (views < kFewestViews || background < kLeast_grey || left >= least * background) continue;
    least = left / background;
    out = bar;  // with its depth: step by step it could drift away from it
    out->v0 += slope;
    out->v1 += slope;
  }
  return out;
}

}  // namespace crane
