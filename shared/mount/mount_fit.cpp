// SPDX-License-Identifier: Apache-2.0
#include "mount/mount_fit.hpp"

#include <ceres/ceres.h>
#include <ceres/cubic_interpolation.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "mount/reduced_covariance.hpp"

namespace crane {
namespace {

constexpr double kRobust = 3;  ///< sigmas from which on an error counts less
constexpr int kPasses = 3;
constexpr std::size_t kLeastSightings = 4;
constexpr double kFarSigmas = 5;  ///< of a track or a reading that does not belong to the rest
constexpr double kFar_m = 0.015;  ///< nor is it far where it is nearer: rounded where speeds change
constexpr double kTrackSigmas = 3;

using Grid = ceres::Grid1D<double>;
using Curve = ceres::CubicInterpolator<Grid>;

/// A point in one frame's pair: what is seen of it against where it must be.
struct SightingError {
  const RectifiedCamera* camera;
  Eigen::Matrix3d R_rectified_map;
  double skew_off, rail_y_m;
  Sighting seen;
  double sigma_px;

  template <class T>
  bool operator()(const T* turn, const T* skew, const T* place, const T* point, T* error) const {
    const T x = place[0] + (skew[0] + skew_off) * (place[1] - rail_y_m);
    const double c = std::cos(std::atan(skew_off));
    const double s = std::sin(std::atan(skew_off));
    const T d[3] = {point[0] - x, point[1] - place[1], point[2]};
    const T level[3] = {c * d[0] - s * d[1], s * d[0] + c * d[1], d[2]};
    T before[3], p[3];
    for (int i = 0; i < 3; ++i)
      before[i] = R_rectified_map(i, 0) * level[0] + R_rectified_map(i, 1) * level[1] +
                  R_rectified_map(i, 2) * level[2];
    ceres::AngleAxisRotatePoint(turn, before, p);
    if (p[2] < 0.05) return false;
    const T u = camera->f_px * p[0] / p[2] + camera->cx_px;
    error[0] = (u - seen.u_px) / sigma_px;
    error[1] = (camera->f_px * p[1] / p[2] + camera->cy_px - seen.v_px) / sigma_px;
    error[2] = (u - camera->f_px * camera->baseline_m / p[2] - seen.right_u_px) / sigma_px;
    return true;
  }
};

/// What a rangefinder says of a frame's time against where its images put it.
struct ReadingError {
  const Curve* curve;
  double start_s, time_s, mean_m;
  int axis;
  double sigma_m;

  template <class T>
  bool operator()(const T* gain, const T* latency, const T* place, T* error) const {
    T distance;
    curve->Evaluate((time_s + latency[0] - start_s) / Readings::kStep_s, &distance);
    error[0] = (gain[0] * (distance - mean_m) - place[axis]) / sigma_m;
    return true;
  }
};

struct FloorError {
  Eigen::Vector2d centre_m;
  double sigma_m;

  template <class T>
  bool operator()(const T* height, const T* slope, const T* point, T* error) const {
    const T floor =
        -height[0] + slope[0] * (point[0] - centre_m.x()) + slope[1] * (point[1] - centre_m.y());
    error[0] = (point[2] - floor) / sigma_m;
    return true;
  }
};

double median(std::vector<double>& v) {
  if (v.empty()) return 0;
  const auto middle = v.begin() + std::ptrdiff_t(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

/// By how much a mean is less sure than that of independent errors: errors in a row that hang
/// together. `pairs`: products of neighbours, `squares`: of each.
double hanging_together(double pairs, double squares) {
  const double correlation = std::clamp(squares > 0 ? pairs / squares : 0, 0.0, 0.95);
  return std::sqrt((1 + correlation) / (1 - correlation));
}

class Fit {
 public:
  Fit(const Drive& drive, const AxisReadings& readings, MountFit& fit)
      : drive_(drive), readings_(readings), fit_(fit) {
    for (const Readings& r : readings) {
      grids_.push_back(std::make_unique<Grid>(r.grid().data(), 0, int(r.grid().size())));
      curves_.push_back(std::make_unique<Curve>(*grids_.back()));
    }
    for (std::size_t i = fit.first; i < fit.last; ++i)
      times_.push_back(double(drive.frames[i].time - drive.frames.front().time) * 1e-9);
  }

  void begin_points() {
    std::vector<std::size_t> seen(drive_.tracks, 0);
    fit_.points_m.assign(drive_.tracks, Eigen::Vector3d::Zero());
    const RectifiedCamera& c = drive_.camera;
    for_each_sighting([&](std::size_t i, const Sighting& s) {
      const double z = c.f_px * c.baseline_m / (s.u_px - s.right_u_px);
      const Eigen::Vector3d p((s.u_px - c.cx_px) / c.f_px * z, (s.v_px - c.cy_px) / c.f_px * z, z);
      Eigen::Vector3d m = fit_.R_map_rectified * p;
      m.head<2>() += fit_.place_m[i];
      m.x() += fit_.skew * (fit_.place_m[i].y() - fit_.rail_y_m);
      const auto n = double(++seen[s.track]);
      fit_.points_m[s.track] += (m - fit_.points_m[s.track]) / n;
    });
    for (std::size_t t = 0; t < drive_.tracks; ++t)
      if (seen[t] < kLeastSightings && fit_.kinds[t] != TrackKind::kWithCamera)
        fit_.kinds[t] = TrackKind::kShort;
  }

  bool solve(bool with_covariance) {
    ceres::Problem problem;
    double turn[3] = {0, 0, 0};
    const Eigen::Matrix3d R_rectified_map = fit_.R_map_rectified.transpose();
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    const auto robust = [] { return new ceres::HuberLoss(kRobust); };
    for_each_sighting([&](std::size_t i, const Sighting& s) {
      double* point = fit_.points_m[s.track].data();
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<SightingError, 3, 3, 1, 2, 3>(new SightingError{
              &drive_.camera, R_rectified_map, fit_.skew_off.empty() ? 0 : fit_.skew_off[i],
              fit_.rail_y_m, s, fit_.pixel_sigma}),
          robust(), turn, &fit_.skew, fit_.place_m[i].data(), point);
      ordering->AddElementToGroup(point, 0);
      ordering->AddElementToGroup(fit_.place_m[i].data(), 1);
    });
    if (problem.NumResidualBlocks() == 0) return false;
    for (std::size_t i = 0; i < times_.size(); ++i)
      for (const int axis : {0, 1}) {
        const auto k = std::size_t(axis);
        if (!fit_.known[i][k]) continue;
        problem.AddResidualBlock(
            new ceres::AutoDiffCostFunction<ReadingError, 1, 1, 1, 2>(
                new ReadingError{curves_[k].get(), readings_[k].start_s(), times_[i],
                                 fit_.mean_m[k], axis, fit_.reading_sigma_m[k]}),
            new ceres::CauchyLoss(kRobust), &fit_.gain[k], &fit_.latency_s[k],
            fit_.place_m[i].data());
        ordering->AddElementToGroup(fit_.place_m[i].data(), 1);
      }
    for (std::size_t t = 0; t < drive_.tracks; ++t)
      if (fit_.kinds[t] == TrackKind::kFloor)
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<FloorError, 1, 1, 2, 3>(
                                     new FloorError{fit_.centre_m, fit_.floor_sigma_m}),
                                 robust(), &fit_.height_m, fit_.slope.data(),
                                 fit_.points_m[t].data());
    std::vector<double*> numbers = {
        turn,       &fit_.gain[0],  &fit_.gain[1],    &fit_.latency_s[0], &fit_.latency_s[1],
        &fit_.skew, &fit_.height_m, fit_.slope.data()};
    for (double* n : numbers) {
      if (!problem.HasParameterBlock(n))
        problem.AddParameterBlock(n, n == fit_.slope.data() ? 2 : 1);
      ordering->AddElementToGroup(n, 1);
    }
    const bool both = fit_.driven[0] && fit_.driven[1];
    for (const std::size_t k : {0U, 1U})
      if (!fit_.driven[k]) {
        problem.SetParameterBlockConstant(&fit_.gain[k]);
        problem.SetParameterBlockConstant(&fit_.latency_s[k]);
      }
    if (!both) {
      problem.SetParameterBlockConstant(fit_.slope.data());
      problem.SetParameterBlockConstant(&fit_.skew);
    }
    for (const std::size_t k : {0U, 1U}) {
      problem.SetParameterLowerBound(&fit_.latency_s[k], 0, -0.9 * Readings::kReach_s);
      problem.SetParameterUpperBound(&fit_.latency_s[k], 0, 0.9 * Readings::kReach_s);
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = ordering;
    options.max_num_iterations = 30;
    options.function_tolerance = 1e-7;
    options.num_threads = 2;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) return false;
    if (with_covariance) {
      std::vector<double*> eliminated;
      for (std::size_t t = 0; t < drive_.tracks; ++t)
        if (problem.HasParameterBlock(fit_.points_m[t].data()))
          eliminated.push_back(fit_.points_m[t].data());
      fit_.covariance = reduced_covariance(problem, numbers, eliminated);
    }
    const Eigen::Vector3d turned(turn[0], turn[1], turn[2]);
    if (turned.norm() > 0)
      fit_.R_map_rectified =
          fit_.R_map_rectified *
          Eigen::AngleAxisd(-turned.norm(), turned.normalized()).toRotationMatrix();
    return true;
  }

  /// Sigmas from what is left; what does not belong to the rest is dropped.
  void weigh() {
    weigh_pixels();
    for (const std::size_t k : {0U, 1U}) weigh_readings(k);
    weigh_floor();
  }

 private:
  template <class Each>
  void for_each_sighting(Each each) const {
    for (std::size_t i = fit_.first; i < fit_.last; ++i)
      for (const Sighting& s : drive_.frames[i].sightings)
        if (fit_.kinds[s.track] == TrackKind::kFixed || fit_.kinds[s.track] == TrackKind::kFloor)
          each(i - fit_.first, s);
  }

  void weigh_pixels() {
    std::vector<std::vector<Eigen::Vector3d>> left(drive_.tracks);
    std::vector<double> sizes;
    const double none[3] = {0, 0, 0};
    for_each_sighting([&](std::size_t i, const Sighting& s) {
      const SightingError error{&drive_.camera,
                                fit_.R_map_rectified.transpose(),
                                fit_.skew_off.empty() ? 0 : fit_.skew_off[i],
                                fit_.rail_y_m,
                                s,
                                1};
      Eigen::Vector3d e(1e3, 1e3, 1e3);
      error(none, &fit_.skew, fit_.place_m[i].data(), fit_.points_m[s.track].data(), e.data());
      left[s.track].push_back(e);
      for (int k = 0; k < 3; ++k) sizes.push_back(std::abs(e[k]));
    });
    const double free_share =
        std::max(0.2, 1 - (3 * double(std::count_if(left.begin(), left.end(),
                                                    [](const auto& l) { return !l.empty(); })) +
                           2 * double(times_.size())) /
                              double(std::max<std::size_t>(1, sizes.size())));
    const double sigma = std::max(0.02, 1.48 * median(sizes) / std::sqrt(free_share));
    double pairs = 0, squares = 0;
    for (std::size_t t = 0; t < drive_.tracks; ++t) {
      if (left[t].empty()) continue;
      double sum = 0;
      for (const auto& e : left[t]) sum += e.squaredNorm();
      if (std::sqrt(sum / (3 * double(left[t].size()))) > kTrackSigmas * sigma) {
        fit_.kinds[t] = TrackKind::kMoves;
        continue;
      }
      for (std::size_t i = 1; i < left[t].size(); ++i) {
        pairs += left[t][i].dot(left[t][i - 1]);
        squares += left[t][i].squaredNorm();
      }
    }
    fit_.pixel_sigma = sigma * hanging_together(pairs, squares);
  }

  void weigh_readings(std::size_t k) {
    std::vector<double> off;
    for (std::size_t i = 0; i < times_.size(); ++i)
      if (fit_.known[i][k])
        off.push_back(fit_.gain[k] *
                          (readings_[k].at(times_[i] + fit_.latency_s[k]) - fit_.mean_m[k]) -
                      fit_.place_m[i][int(k)]);
    std::vector<double> sizes;
    for (const double o : off) sizes.push_back(std::abs(o));
    const double sigma = std::max(1e-4, 1.48 * median(sizes));
    const double most = std::max(kFarSigmas * sigma, kFar_m);
    double pairs = 0, squares = 0;
    std::size_t far = 0;
    for (std::size_t i = 0; i < off.size(); ++i) {
      if (std::abs(off[i]) > most) ++far;
      if (i == 0 || std::max(std::abs(off[i]), std::abs(off[i - 1])) > kFarSigmas * sigma) continue;
      pairs += off[i] * off[i - 1];
      squares += off[i] * off[i];
    }
    fit_.far_readings[k] = double(far) / double(std::max<std::size_t>(1, off.size()));
    fit_.reading_sigma_m[k] = sigma * hanging_together(pairs, squares);
  }

  void weigh_floor() {
    std::vector<double> sizes;
    for (std::size_t t = 0; t < drive_.tracks; ++t) {
      if (fit_.kinds[t] != TrackKind::kFloor) continue;
      double e = 0;
      FloorError{fit_.centre_m, 1}(&fit_.height_m, fit_.slope.data(), fit_.points_m[t].data(), &e);
      sizes.push_back(std::abs(e));
    }
    fit_.floor_sigma_m = std::max(5e-4, 1.48 * median(sizes));
  }

  const Drive& drive_;
  const AxisReadings& readings_;
  MountFit& fit_;
  std::vector<std::unique_ptr<Grid>> grids_;
  std::vector<std::unique_ptr<Curve>> curves_;
  std::vector<double> times_;
};

}  // namespace

bool refine(const Drive& drive, const AxisReadings& readings, MountFit& fit) {
  Fit work(drive, readings, fit);
  if (fit.points_m.empty()) work.begin_points();
  std::vector<double> levels_m;
  for (int pass = 0; pass < kPasses; ++pass) {
    if (!work.solve(pass + 1 == kPasses)) return false;
    if (pass + 1 < kPasses) work.weigh();
    find_floor(drive, fit, levels_m);
  }
  return true;
}

}  // namespace crane
