// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/format.hpp"
#include "mount/mount_fit.hpp"

namespace crane {
namespace {

constexpr std::size_t kLeastCommon = 15;  ///< points that two frames must share
constexpr std::size_t kLeastFrames = 20;
constexpr double kWithCamera_px = 2.5;  ///< such a track did not move in the image
constexpr double kWayOfTrack = 0.08;    ///< while the crane went so far, in camera heights
constexpr double kReach_s = 0.5, kStep_s = 0.02;  ///< of delays that are looked for
constexpr double kTogether = 0.98;                ///< correlation of both axes
constexpr double kRest = 0.5;     ///< of the way an axis needs, between images and readings
constexpr double kSquare = 0.09;  ///< sine of what the axes may be off square

using Points = std::unordered_map<std::size_t, Eigen::Vector3d>;

Points points_of(const DriveFrame& frame, const RectifiedCamera& c, const MountFit& fit) {
  Points out;
  for (const Sighting& s : frame.sightings) {
    if (fit.kinds[s.track] != TrackKind::kFixed) continue;
    const double z = c.f_px * c.baseline_m / (s.u_px - s.right_u_px);
    out[s.track] = {(s.u_px - c.cx_px) / c.f_px * z, (s.v_px - c.cy_px) / c.f_px * z, z};
  }
  return out;
}

double median(std::vector<double> v) {
  const auto middle = v.begin() + std::ptrdiff_t(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

/// Tracks that stay where they are in the image while the crane drives.
void find_what_comes_along(const Drive& drive, const AxisReadings& readings, MountFit& fit) {
  struct Life {
    Eigen::Array4d low = Eigen::Array4d::Constant(1e9), high = Eigen::Array4d::Constant(-1e9);
    int count = 0;
  };
  std::vector<Life> lives(drive.tracks);
  for (const DriveFrame& frame : drive.frames) {
    const double t = double(frame.time - drive.frames.front().time) * 1e-9;
    const double bridge_m = readings[0].at(t);
    const double trolley_m = readings[1].at(t);
    for (const Sighting& s : frame.sightings) {
      Life& life = lives[s.track];
      const Eigen::Array4d now(s.u_px, s.v_px, bridge_m, trolley_m);
      life.low = life.low.min(now);
      life.high = life.high.max(now);
      ++life.count;
    }
  }
  fit.kinds.assign(drive.tracks, TrackKind::kFixed);
  for (std::size_t i = 0; i < drive.tracks; ++i) {
    const Life& life = lives[i];
    if (life.count < 3) {
      fit.kinds[i] = TrackKind::kShort;
      continue;
    }
    const Eigen::Array4d way = life.high - life.low;
    if (way.tail<2>().maxCoeff() > kWayOfTrack * drive.told_height_m &&
        way.head<2>().maxCoeff() < kWithCamera_px)
      fit.kinds[i] = TrackKind::kWithCamera;
  }
}

/// How far the camera went, in its own axes; the longest stretch of frames that hang together.
std::vector<Eigen::Vector3d> chain(const Drive& drive, MountFit& fit) {
  std::vector<Eigen::Vector3d> best, now;
  std::size_t best_first = 0, first = 0;
  Points before;
  for (std::size_t i = 0; i < drive.frames.size(); ++i) {
    Points here = points_of(drive.frames[i], drive.camera, fit);
    std::array<std::vector<double>, 3> steps;
    for (const auto& [track, p] : here)
      if (const auto b = before.find(track); b != before.end())
        for (int k = 0; k < 3; ++k) steps[std::size_t(k)].push_back(b->second[k] - p[k]);
    if (now.empty() || steps[0].size() < kLeastCommon) {
      now = {Eigen::Vector3d::Zero()};
      first = i;
    } else {
      now.emplace_back(now.back() +
                       Eigen::Vector3d(median(steps[0]), median(steps[1]), median(steps[2])));
    }
    if (now.size() > best.size()) best = now, best_first = first;
    before = std::move(here);
  }
  fit.first = best_first;
  fit.last = best_first + best.size();
  return best;
}

/// The camera's places as c + A (readings later by latency), and what that leaves.
struct Regression {
  Eigen::Matrix<double, 3, 2> A = Eigen::Matrix<double, 3, 2>::Zero();
  double rest_m2 = 1e18;
};

Regression regress(const std::vector<Eigen::Vector3d>& places, const std::vector<double>& times,
                   const AxisReadings& readings, const MountFit& fit,
                   const std::array<double, 2>& latency_s) {
  const auto n = Eigen::Index(places.size());
  Eigen::MatrixXd M(n, 3), C(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    M(i, 0) = 1;
    for (int k = 0; k < 2; ++k) {
      const auto& r = readings[std::size_t(k)];
      M(i, 1 + k) =
          fit.driven[std::size_t(k)]
              ? r.at(times[std::size_t(i)] + latency_s[std::size_t(k)]) - fit.mean_m[std::size_t(k)]
              : 0;
    }
    C.row(i) = places[std::size_t(i)];
  }
  Eigen::Matrix3d N = M.transpose() * M;
  N.diagonal().array() += 1e-9;
  const Eigen::Matrix3d X = N.ldlt().solve(M.transpose() * C);
  Regression out;
  out.A = X.bottomRows(2).transpose();
  out.rest_m2 = (C - M * X).rowwise().squaredNorm().mean();
  return out;
}

/// The normal of most of what is seen, in the camera's axes, upwards.
Eigen::Vector3d floor_normal(const Drive& drive, const MountFit& fit,
                             const std::vector<Eigen::Vector3d>& places) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = fit.first; i < fit.last; i += 1 + (fit.last - fit.first) / 20)
    for (const auto& [track, p] : points_of(drive.frames[i], drive.camera, fit))
      points.emplace_back(p + places[i - fit.first]);
  Eigen::Vector3d plane(0, 0, 0);  // z = a x + b y + c
  std::vector<double> z;
  for (const auto& p : points) z.push_back(p.z());
  if (z.empty()) return -Eigen::Vector3d::UnitZ();
  plane.z() = median(z);
  for (int round = 0; round < 10; ++round) {
    const double band = drive.told_height_m * (round < 5 ? 0.1 : 0.03);
    Eigen::Matrix3d N = 1e-9 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
    for (const auto& p : points) {
      const Eigen::Vector3d row(p.x(), p.y(), 1);
      const double off = (p.z() - row.dot(plane)) / band;
      const double weight = 1 / (1 + off * off);
      N += weight * row * row.transpose();
      rhs += weight * p.z() * row;
    }
    plane = N.ldlt().solve(rhs);
  }
  return Eigen::Vector3d(plane.x(), plane.y(), -1).normalized();
}

/// How nearly one axis's readings are a line of the other's: 1 when always.
double together(const std::vector<double>& times, const AxisReadings& readings) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (const double t : times) {
    const Eigen::Vector2d r(readings[0].at(t), readings[1].at(t));
    mean += r;
    squares += r * r.transpose();
  }
  const auto n = double(times.size());
  const Eigen::Matrix2d C = squares / n - mean / n * mean.transpose() / n;
  return std::abs(C(0, 1)) / std::sqrt(std::max(1e-12, C(0, 0) * C(1, 1)));
}

/// Standing, or images and readings that do not belong together.
std::string what_is_missing(const Drive& drive, const AxisReadings& readings, const MountFit& fit,
                            const std::vector<Eigen::Vector3d>& places) {
  const double need_m = DriveNeeds::way_m(drive.told_height_m);
  Eigen::Vector3d low = places.front();
  Eigen::Vector3d high = low;
  for (const auto& p : places) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const double seen_m = (high - low).norm();
  const bool reads = fit.driven[0] || fit.driven[1];
  if (!reads && seen_m < need_m)
    return formatted("the crane stands: drive bridge and trolley %.1f m each, there and back",
                     std::max(1.0, 2 * need_m));
  if (!reads)
    return formatted(
        "the images move by %.2f m, the rangefinders by %.2f and %.2f m: they do not measure the "
        "crane's way (cranemap doctor), or their beams are interrupted",
        seen_m, readings[0].way_m(), readings[1].way_m());
  if (seen_m < 0.3 * need_m)
    return formatted(
        "the rangefinders say that the crane drives, the images stand: a load fills the view, "
        "the lens cap is on, or the camera repeats one image (they moved by %.2f m)",
        seen_m);
  return {};
}

}  // namespace

double DriveNeeds::way_m(double height_m) {
  return std::max(0.25, 0.12 * height_m);
}

std::optional<MountFit> first_guess(const Drive& drive, const AxisReadings& readings,
                                    const Eigen::Matrix3d& told, std::array<int, 2> told_direction,
                                    std::optional<int> cart_direction, std::string& flaw) {
  MountFit fit;
  find_what_comes_along(drive, readings, fit);
  const auto places = chain(drive, fit);
  if (places.size() < std::max(kLeastFrames, drive.frames.size() / 2)) {
    flaw = formatted(
        "only %zu of %zu frames in a row share enough points: the floor has no texture, it is too "
        "dark, a load covers it, or the crane drives too fast for the frame rate (lay out printed "
        "paper or cloths, switch on the light, drive slowly)",
        places.size(), drive.frames.size());
    return std::nullopt;
  }
  std::vector<double> times;
  for (std::size_t i = fit.first; i < fit.last; ++i)
    times.push_back(double(drive.frames[i].time - drive.frames.front().time) * 1e-9);
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<double> r;
    for (const double t : times) r.push_back(readings[k].at(t));
    const auto [low, high] = std::minmax_element(r.begin(), r.end());
    fit.driven[k] = *high - *low >= DriveNeeds::way_m(drive.told_height_m);
    fit.mean_m[k] = 0.5 * (*low + *high);
  }
  flaw = what_is_missing(drive, readings, fit, places);
  if (!flaw.empty()) return std::nullopt;
  if (fit.driven[0] && fit.driven[1] && together(times, readings) > kTogether) {
    flaw =
        "bridge and trolley always move together, or both rangefinders measure the same axis: "
        "drive "
        "one after the other";
    return std::nullopt;
  }
  Regression best;
  const auto search = [&](std::size_t axis, double reach, double step) {
    const double from = fit.latency_s[axis];
    for (double l = from - reach; l <= from + reach + 1e-9; l += step) {
      auto latency = fit.latency_s;
      latency[axis] = l;
      const Regression r = regress(places, times, readings, fit, latency);
      if (r.rest_m2 < best.rest_m2) best = r, fit.latency_s = latency;
    }
  };
  for (double l = -kReach_s; l <= kReach_s + 1e-9; l += kStep_s) {
    const Regression r = regress(places, times, readings, fit, {l, l});
    if (r.rest_m2 < best.rest_m2) best = r, fit.latency_s = {l, l};
  }
  for (int round = 0; round < 3; ++round)
    for (const std::size_t axis : {0U, 1U})
      if (fit.driven[axis]) search(axis, round == 0 ? kReach_s : kStep_s, kStep_s / 2);
  for (const std::size_t k : {0U, 1U})
    if (!fit.driven[k]) fit.latency_s[k] = 0;
  if (const double rest_m = std::sqrt(best.rest_m2);
      rest_m > kRest * DriveNeeds::way_m(drive.told_height_m)) {
    flaw = formatted(
        "images and readings are %.2f m apart on the way: %s, readings stick, or they are of "
        "another clock (cranemap doctor)",
        rest_m,
        fit.driven[0] && fit.driven[1] ? "something else moves below the camera"
                                       : "a rangefinder does not follow its axis");
    return std::nullopt;
  }
  Eigen::Vector3d a = best.A.col(0);
  Eigen::Vector3d b = best.A.col(1);
  const Eigen::Vector3d n = floor_normal(drive, fit, places);
  if (!fit.driven[0]) a = told_direction[0] * b.cross(n) * told_direction[1];
  if (!fit.driven[1]) b = told_direction[1] * n.cross(a) * told_direction[0];
  for (const std::size_t k : {0U, 1U}) {
    const double size = (k == 0 ? a : b).norm();
    if (size > 0.8 && size < 1.25) continue;
    flaw = formatted(
        "the camera goes %.3f m for each metre of the %s's rangefinder: wrong unit, wrong "
        "baseline, or it measures something else",
        size, k == 0 ? "bridge" : "trolley");
    return std::nullopt;
  }
  if (std::abs(a.normalized().dot(b.normalized())) > kSquare) {
    flaw = formatted(
        "bridge and trolley move the camera along directions %.1f degrees apart, not 90: do both "
        "rangefinders measure the same axis?",
        std::acos(a.normalized().dot(b.normalized())) * 180 / M_PI);
    return std::nullopt;
  }
  Eigen::Vector3d up = a.cross(b).normalized();
  if (up.z() > 0) up = -up;
  Eigen::Vector3d x = (a - a.dot(up) * up).normalized();
  // Which way the map's x grows is agreed, not measured: by the told camera, if it can tell.
  const double along = x.dot(told.row(0).transpose());
  const int direction =
      cart_direction ? *cart_direction
                     : (std::abs(along) > M_SQRT1_2 ? (along > 0 ? 1 : -1) : told_direction[0]);
  x *= direction;
  const Eigen::Vector3d y = up.cross(x);
  fit.R_map_rectified.row(0) = x;
  fit.R_map_rectified.row(1) = y;
  fit.R_map_rectified.row(2) = up;
  fit.gain = {direction * a.norm(), (b.dot(y) > 0 ? 1 : -1) * b.norm()};
  for (const std::size_t k : {0U, 1U})
    if (!fit.driven[k]) fit.gain[k] = fit.gain[k] > 0 ? 1 : -1;
  for (std::size_t i = fit.first; i < fit.last; ++i) {
    Eigen::Vector2d place;
    std::array<bool, 2> known{};
    for (const std::size_t k : {0U, 1U}) {
      const double t = times[i - fit.first] + fit.latency_s[k];
      place[int(k)] = fit.gain[k] * (readings[k].at(t) - fit.mean_m[k]);
      known[k] = readings[k].known(t);
    }
    fit.place_m.push_back(place);
    fit.known.push_back(known);
  }
  return fit;
}

}  // namespace crane
