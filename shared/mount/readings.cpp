// SPDX-License-Identifier: Apache-2.0
#include "mount/readings.hpp"

#include <algorithm>
#include <cmath>

#include "base/format.hpp"

namespace crane {
namespace {

constexpr std::size_t kLeast = 10;
constexpr std::size_t kAround = 3;   ///< readings to either side that one is compared with
constexpr double kOutlier_m = 0.02;  ///< off those around
constexpr double kOutlierSigmas = 8;
constexpr double kMoves_m = 0.02;     ///< within a second: the axis moves
constexpr double kRepeatShare = 0.3;  ///< of readings while it moves: the device repeats
constexpr double kHalfWidth = 1.8;    ///< of the local mean, in intervals

double median(std::vector<double> v) {
  if (v.empty()) return 0;
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

}  // namespace

Readings::Readings(const std::vector<RecordedDistance>& raw, TimeNs from,
                   const MapperConfig& limits) {
  gap_s_ = limits.max_position_gap_ms * 1e-3;
  take(raw, from, limits);
  if (time_s_.size() < kLeast) {
    flaw_ = formatted("has %zu usable readings of %zu: look at the device (cranemap doctor)",
                      time_s_.size(), raw.size());
    return;
  }
  drop_outliers();
  find_jump(limits);
  drop_repeats();
  smooth();
}

void Readings::take(const std::vector<RecordedDistance>& raw, TimeNs from,
                    const MapperConfig& limits) {
  for (const RecordedDistance& r : raw) {
    const double t = double(r.time - from) * 1e-9;
    const bool good = std::isfinite(r.distance_m) && r.distance_m >= limits.rangefinder_min_m &&
                      r.distance_m <= limits.rangefinder_max_m;
    if (!good || (!time_s_.empty() && t <= time_s_.back())) {
      ++dropped_;
      continue;
    }
    time_s_.push_back(t);
    distance_m_.push_back(r.distance_m);
  }
}

void Readings::drop_outliers() {
  const std::size_t n = distance_m_.size();
  std::vector<double> off(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t low = i < kAround ? 0 : i - kAround;
    const std::size_t high = std::min(n, i + kAround + 1);
    off[i] = std::abs(distance_m_[i] - median({distance_m_.begin() + std::ptrdiff_t(low),
                                               distance_m_.begin() + std::ptrdiff_t(high)}));
  }
  const double most = std::max(kOutlier_m, kOutlierSigmas * 1.48 * median(off));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < n; ++i) {
    // The first and last few stand at the side of those around, not in their middle.
    const bool at_end = i < kAround || i + kAround >= n;
    if (off[i] > (at_end ? 10 : 1) * most) continue;
    time_s_[kept] = time_s_[i];
    distance_m_[kept++] = distance_m_[i];
  }
  dropped_ += n - kept;
  time_s_.resize(kept);
  distance_m_.resize(kept);
}

void Readings::find_jump(const MapperConfig& limits) {
  for (std::size_t i = 1; i < time_s_.size(); ++i) {
    const double passed_s = time_s_[i] - time_s_[i - 1];
    const double step_m = distance_m_[i] - distance_m_[i - 1];
    if (std::abs(step_m) <= limits.largest_speed_mps * passed_s + limits.rangefinder_noise_m)
      continue;
    flaw_ = formatted(
        "jumps by %.3f m after %.1f s: no crane moves so; look for what crosses the beam, and at "
        "its target (mapper.largest_speed_mps says how fast the crane may be)",
        step_m, time_s_[i]);
    return;
  }
}

/// A device that measures less often than it speaks: only the first of equal readings is fresh.
void Readings::drop_repeats() {
  const std::size_t n = time_s_.size();
  std::vector<bool> moves(n, false), stale(n, false);
  std::size_t moving = 0, repeats = 0, low = 0, high = 0;
  for (std::size_t i = 0; i < n; ++i) {
    while (time_s_[i] - time_s_[low] > 0.5) ++low;
    while (high + 1 < n && time_s_[high] - time_s_[i] < 0.5) ++high;
    moves[i] = std::abs(distance_m_[high] - distance_m_[low]) > kMoves_m;
    if (!moves[i] || i == 0) continue;
    ++moving;
    stale[i] = distance_m_[i] == distance_m_[i - 1];
    if (stale[i]) ++repeats;
  }
  if (moving < kLeast || double(repeats) < kRepeatShare * double(moving)) return;
  repeats_ = double(moving) / double(std::max<std::size_t>(1, moving - repeats));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (stale[i]) continue;
    time_s_[kept] = time_s_[i];
    distance_m_[kept++] = distance_m_[i];
  }
  time_s_.resize(kept);
  distance_m_.resize(kept);
}

/// Least squares line through the readings around, the nearer ones weighing more.
double Readings::local(double time_s, double half_s) const {
  const auto first = std::lower_bound(time_s_.begin(), time_s_.end(), time_s - half_s);
  const auto last = std::upper_bound(time_s_.begin(), time_s_.end(), time_s + half_s);
  double w0 = 0, w1 = 0, w2 = 0, y0 = 0, y1 = 0;
  for (auto t = first; t != last; ++t) {
    const double d = (*t - time_s) / half_s;
    const double c = 1 - std::abs(d * d * d);
    const double w = c * c * c;
    const double y = distance_m_[static_cast<std::size_t>(t - time_s_.begin())];
    w0 += w, w1 += w * d, w2 += w * d * d, y0 += w * y, y1 += w * d * y;
  }
  const double det = w0 * w2 - w1 * w1;
  if (det > 1e-3 * w0 * w0) return (w2 * y0 - w1 * y1) / det;
  // Fewer than two: a straight line between those beside.
  const auto after = std::lower_bound(time_s_.begin(), time_s_.end(), time_s);
  if (after == time_s_.begin()) return distance_m_.front();
  if (after == time_s_.end()) return distance_m_.back();
  const auto i = static_cast<std::size_t>(after - time_s_.begin());
  const double share = (time_s - time_s_[i - 1]) / (time_s_[i] - time_s_[i - 1]);
  return distance_m_[i - 1] + share * (distance_m_[i] - distance_m_[i - 1]);
}

void Readings::smooth() {
  if (time_s_.size() < 2) return;
  std::vector<double> apart;
  for (std::size_t i = 1; i < time_s_.size(); ++i) apart.push_back(time_s_[i] - time_s_[i - 1]);
  const double half_s = kHalfWidth * median(apart);
  start_s_ = time_s_.front() - kReach_s;
  const auto n =
      static_cast<std::size_t>((time_s_.back() - time_s_.front() + 2 * kReach_s) / kStep_s) + 2;
  grid_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double t = start_s_ + double(i) * kStep_s;
    grid_[i] = local(std::clamp(t, time_s_.front(), time_s_.back()), half_s);
  }
}

double Readings::at(double time_s) const {
  if (grid_.empty()) return 0;
  const double x = std::clamp((time_s - start_s_) / kStep_s, 0.0, double(grid_.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(x), grid_.size() - 2);
  return grid_[i] + (x - double(i)) * (grid_[i + 1] - grid_[i]);
}

double Readings::mps(double time_s) const {
  return (at(time_s + 0.1) - at(time_s - 0.1)) / 0.2;
}

bool Readings::known(double time_s) const {
  const auto after = std::lower_bound(time_s_.begin(), time_s_.end(), time_s);
  if (after == time_s_.begin() || after == time_s_.end()) return false;
  return *after - *(after - 1) <= std::max(gap_s_, 0.2);
}

double Readings::way_m() const {
  if (grid_.empty()) return 0;
  const auto [low, high] = std::minmax_element(grid_.begin(), grid_.end());
  return *high - *low;
}

}  // namespace crane
