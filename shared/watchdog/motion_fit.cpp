// SPDX-License-Identifier: Apache-2.0
#include "watchdog/motion_fit.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

/// How large scale, turn and delay can be at all: what is far below is left to the samples.
constexpr double kScale = 1, kTurn = 0.2, kDelay_s = 0.3;
/// Of a reading of one rangefinder, and of images from key to key [m].
constexpr double kNoise_m = 0.001;

/// Ways shorter than this, and speeds that differ by less, tell nothing; speeds are over so long.
constexpr double kLeastWay_m = 0.15, kLeastSpeed_mps = 0.1, kSpeedOver_s = 0.08;

struct Spread {
  double range = 0, variance = 1e-12;
};

template <class Value>
Spread spread(const std::vector<MotionSample>& samples, Value value) {
  double low = value(samples.front());
  double high = low;
  double sum = 0;
  double squares = 0;
  for (const MotionSample& s : samples) {
    const double v = value(s) - value(samples.front());
    low = std::min(low, value(s)), high = std::max(high, value(s));
    sum += v, squares += v * v;
  }
  const auto n = double(samples.size());
  return {high - low, std::max(1e-12, squares / n - sum / n * sum / n)};
}

struct Solution {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;  ///< for errors of 1 m
  std::vector<double> rest;
};

Solution solve(const std::vector<MotionSample>& samples, int axis, std::size_t step_at,
               bool stepped, double noise_m) {
  const int unknowns = stepped ? 5 : 4;
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(unknowns);
  const Eigen::Vector2d from = samples.front().place_m;
  const auto row_of = [&](std::size_t i) {
    const MotionSample& s = samples[i];
    Eigen::VectorXd row(unknowns);
    row[0] = 1;
    row[1] = s.place_m[axis] - from[axis];
    row[2] = s.place_m[1 - axis] - from[1 - axis];
    row[3] = s.speed_mps[axis];
    if (stepped) row[4] = i >= step_at ? 1 : 0;
    return row;
  };
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::VectorXd row = row_of(i);
    N += row * row.transpose();
    rhs += row * samples[i].off_m[axis];
  }
  const double w = noise_m * noise_m;
  N(0, 0) += w / 1e6;
  N(1, 1) += w / (kScale * kScale);
  N(2, 2) += w / (kTurn * kTurn);
  N(3, 3) += w / (kDelay_s * kDelay_s);
  if (stepped) N(4, 4) += w / 100;
  Solution s;
  const auto factors = N.ldlt();
  s.value = factors.solve(rhs);
  s.covariance = factors.solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  for (std::size_t i = 0; i < samples.size(); ++i)
    s.rest.push_back(samples[i].off_m[axis] - row_of(i).dot(s.value));
  return s;
}

double rms(const std::vector<double>& values) {
  double squares = 0;
  for (const double v : values) squares += v * v;
  return std::sqrt(squares / double(std::max<std::size_t>(1, values.size())));
}

}  // namespace

AxisFit fit_axis(const std::vector<MotionSample>& samples, int axis) {
  AxisFit fit;
  if (samples.size() < 3) return fit;
  const Solution s = solve(samples, axis, 0, false, 2 * kNoise_m);
  fit.rest_m = rms(s.rest);
  double together = 0, squares = 1e-12;
  for (std::size_t i = 1; i < s.rest.size(); ++i) {
    together += s.rest[i] * s.rest[i - 1];
    squares += s.rest[i] * s.rest[i];
  }
  // What chance makes of a few independent errors is no correlation.
  const double chance = 1.5 / std::sqrt(double(s.rest.size()));
  const double correlation = std::clamp(together / squares - chance, 0.0, 0.97);
  const double independent = (1 - correlation) / (1 + correlation);
  // Few samples fit anything: those that are left over count.
  const double left = std::max(0.5, double(samples.size()) - 4) / double(samples.size());
  double told_m = kNoise_m;
  for (const MotionSample& m : samples) told_m = std::max(told_m, m.sigma_m);
  const double noise_m = std::hypot(fit.rest_m / std::sqrt(left), told_m) / std::sqrt(independent);
  // Readings err in the way as well as in what images find too much of it: where an axis hardly
  // moves, that alone looks like a scale of -1. Said is only what is far beyond it.
  const Spread way = spread(samples, [axis](const MotionSample& m) { return m.place_m[axis]; });
  const Spread other =
      spread(samples, [axis](const MotionSample& m) { return m.place_m[1 - axis]; });
  const Spread speed = spread(samples, [axis](const MotionSample& m) { return m.speed_mps[axis]; });
  const double noise_m2 = fit.rest_m * fit.rest_m;
  const auto figure = [&](int i, bool told, double bias) {
    if (!told) return Figure{};
    return Figure{s.value[i],
                  std::hypot(bias, noise_m * std::sqrt(std::max(0.0, s.covariance(i, i))))};
  };
  fit.scale = figure(1, way.range > kLeastWay_m, noise_m2 / way.variance);
  fit.turn = figure(2, other.range > kLeastWay_m, 0);
  fit.delay_s = figure(3, speed.variance > kLeastSpeed_mps * kLeastSpeed_mps,
                       noise_m2 / (kSpeedOver_s * speed.variance));
  return fit;
}

std::optional<Step> best_step(const std::vector<MotionSample>& samples, int axis) {
  if (samples.size() < 4) return std::nullopt;
  std::optional<Step> best;
  for (std::size_t at = 1; at + 2 <= samples.size(); ++at) {
    const Solution s = solve(samples, axis, at, true, 2 * kNoise_m);
    const double rest = rms(s.rest);
    if (best && rest >= best->rest_m) continue;
    best = Step{at, -s.value[4], rest};
  }
  return best;
}

}  // namespace crane
