// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "mount/mount_fit.hpp"

namespace crane {
namespace {

constexpr double kBand = 0.025;    ///< a level is so thick, in camera heights
constexpr double kShare = 0.15;    ///< of the points are on it
constexpr double kNearTold = 0.1;  ///< the told height may be so far off
constexpr double kSigmas = 4;      ///< of the floor's unevenness

}  // namespace

void find_floor(const Drive& drive, MountFit& fit, std::vector<double>& levels_m) {
  std::vector<double> depths;  // below the camera, without the slope
  const auto depth_of = [&](const Eigen::Vector3d& p) {
    return -p.z() + fit.slope.dot(p.head<2>() - fit.centre_m);
  };
  for (std::size_t t = 0; t < drive.tracks; ++t)
    if (fit.kinds[t] == TrackKind::kFixed || fit.kinds[t] == TrackKind::kFloor)
      depths.push_back(depth_of(fit.points_m[t]));
  levels_m.clear();
  if (depths.size() < 20) return;
  std::sort(depths.begin(), depths.end());
  const double band_m = kBand * depths[depths.size() / 2];
  const auto least = std::size_t(kShare * double(depths.size()));
  // Bands with more points than any that overlaps with them.
  std::vector<std::size_t> in(depths.size());
  for (std::size_t i = 0, end = 0; i < depths.size(); ++i) {
    while (end < depths.size() && depths[end] < depths[i] + band_m) ++end;
    in[i] = end - i;
  }
  double best_m = 0;
  std::size_t best = 0;
  bool best_is_near = false;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    if (in[i] < least) continue;
    bool highest = true;
    for (std::size_t j = 0; j < depths.size() && highest; ++j)
      if (std::abs(depths[j] - depths[i]) < band_m && (in[j] > in[i] || (in[j] == in[i] && j < i)))
        highest = false;
    if (!highest) continue;
    const double level = depths[i + in[i] / 2];
    levels_m.push_back(level);
    const bool near = std::abs(level - drive.told_height_m) < kNearTold * drive.told_height_m;
    if (best == 0 || (near && !best_is_near) || (near == best_is_near && in[i] > best))
      best = in[i], best_m = level, best_is_near = near;
  }
  if (best == 0) return;
  const bool first = std::none_of(fit.kinds.begin(), fit.kinds.end(),
                                  [](TrackKind k) { return k == TrackKind::kFloor; });
  if (first) {
    fit.height_m = best_m;
    fit.floor_sigma_m = 0.25 * band_m;
  }
  const double most_m = first ? band_m : std::max(0.2 * band_m, kSigmas * fit.floor_sigma_m);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  std::size_t count = 0;
  for (std::size_t t = 0; t < drive.tracks; ++t) {
    if (fit.kinds[t] != TrackKind::kFixed && fit.kinds[t] != TrackKind::kFloor) continue;
    const bool on = std::abs(depth_of(fit.points_m[t]) - fit.height_m) < most_m;
    fit.kinds[t] = on ? TrackKind::kFloor : TrackKind::kFixed;
    if (!on) continue;
    sum += fit.points_m[t].head<2>();
    ++count;
  }
  if (first && count > 0) fit.centre_m = sum / double(count);
}

}  // namespace crane
