// SPDX-License-Identifier: Apache-2.0
#include "watchdog/watchdog.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace crane {
namespace {

constexpr double kHeight = 2, kDegree = 0.017453292519943295;

/// A level camera at 2 m above a floor of these heights; the calibration is off as told.
struct FloorScene {
  std::function<double(double x, double y)> floor = [](double, double) { return 0.; };
  double told_higher_m = 0;  ///< camera height as told minus true
  double tilt_rad = 0;       ///< of the mount about map y, as told; it is level
  double depth_share = 0;    ///< all depths are so much too large
  double noise_m = 0.001;
};

/// Heights as a frame at (x, y) would see them, on the grid that FloorWatch gets.
FrameView view_of(const FloorScene& scene, double x, double y, std::mt19937& random) {
  FrameView v;
  v.columns = 32, v.rows = 18, v.edge_px = 40, v.f_px = 700, v.cx_px = 640, v.cy_px = 360;
  const Eigen::Matrix3d down = Eigen::Vector3d(1, -1, -1).asDiagonal();
  v.T_map_rectified.linear() =
      Eigen::AngleAxisd(scene.tilt_rad, Eigen::Vector3d::UnitY()).toRotationMatrix() * down;
  v.T_map_rectified.translation() = Eigen::Vector3d(x, y, kHeight + scene.told_higher_m);
  v.T_rectified_map = v.T_map_rectified.inverse();
  v.cells.resize(32 * 18);
  std::normal_distribution<double> noise(0, scene.noise_m);
  for (int row = 0; row < 18; ++row)
    for (int column = 0; column < 32; ++column) {
      const Eigen::Vector3d ray((column * 40 + 20 - 640) / 700., (row * 40 + 20 - 360) / 700., 1);
      const Eigen::Vector3d true_ray = down * ray;
      double depth = kHeight;
      for (int i = 0; i < 5; ++i)
        depth = kHeight - scene.floor(x + true_ray.x() * depth, y + true_ray.y() * depth);
      depth = depth * (1 + scene.depth_share) + noise(random);
      ViewCell& c = v.cells[std::size_t(row) * 32 + std::size_t(column)];
      c.map_m = (v.T_map_rectified * (ray * depth)).cast<float>();
      c.known = c.flat = true;
    }
  return v;
}

FloorWatch::Finding drive(const FloorScene& scene, int frames = 20, double step_m = 0.15) {
  std::mt19937 random(1);
  FloorWatch watch(kHeight);
  for (int i = 0; i < frames; ++i)
    watch.add(view_of(scene, i < frames / 2 ? i * step_m : frames / 2 * step_m,
                      i < frames / 2 ? 0 : (i - frames / 2) * step_m, random),
              0.002);
  return watch.finding();
}

TEST(FloorWatch, FindsNothingOverALevelFloor) {
  const auto f = drive({});
  EXPECT_LT(std::abs(f.height_m.value), 0.002);
  EXPECT_LT(std::abs(f.slope_x.value), 0.05 * kDegree);
  EXPECT_LT(std::abs(f.slope_y.value), 0.05 * kDegree);
}

TEST(FloorWatch, FindsTheHeightOfTheCamera) {
  for (const double off : {-0.1, -0.02, 0.02, 0.1}) {
    FloorScene scene;
    scene.told_higher_m = off;
    const auto f = drive(scene, 8);
    EXPECT_NEAR(f.height_m.value, off, 0.003);
    EXPECT_GT(f.height_m.sigmas(), 5);
  }
}

TEST(FloorWatch, TellsATiltedCameraFromASlopedFloor) {
  for (const double tilt : {-0.5, 0.5, 2.0}) {
    FloorScene tilted;
    tilted.tilt_rad = tilt * kDegree;
    const auto f = drive(tilted);
    // About map y: heights fall along x.
    EXPECT_NEAR(f.slope_x.value, -tilt * kDegree, 0.1 * kDegree);
    EXPECT_GT(f.slope_x.sigmas(), 5);
    EXPECT_LT(std::abs(f.slope_y.value), 0.1 * kDegree);
  }
  FloorScene sloped;
  sloped.floor = [](double x, double) { return 0.01 * x; };
  const auto f = drive(sloped);
  EXPECT_LT(std::abs(f.slope_x.value), 0.1 * kDegree);
  EXPECT_NEAR(f.seen_slope_x.value, 0.01, 0.002);
  EXPECT_LT(std::abs(f.height_m.value), 0.004 * kHeight) << "a slope is no height";
}

TEST(FloorWatch, IsNotMovedByBoxesPitsAndUnevenness) {
  FloorScene scene;
  scene.floor = [](double x, double y) {
    if (x > 0.5 && x < 1.2 && y > -0.5 && y < 0.3) return 0.4;
    if (x > -0.6 && x < 0 && y > 0.2 && y < 0.6) return -0.1;
    return 0.01 * std::sin(5 * x) * std::cos(4 * y);
  };
  const auto f = drive(scene);
  EXPECT_LT(std::abs(f.height_m.value), 0.004 * kHeight);
  EXPECT_LT(std::abs(f.slope_x.value), 0.15 * kDegree);
  EXPECT_LT(std::abs(f.slope_y.value), 0.15 * kDegree);
}

/// Starts and stops along both axes: off_m as a fault makes it.
std::vector<MotionSample> motion(const std::function<Eigen::Vector2d(const MotionSample&)>& off,
                                 double noise_m = 0.001) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, noise_m);
  std::vector<MotionSample> out;
  MotionSample s;
  for (int i = 0; i < 80; ++i) {
    s.time_s = 0.1 * i;
    s.speed_mps = i % 40 < 5    ? Eigen::Vector2d(0, 0)
                  : i % 40 < 20 ? Eigen::Vector2d(0.5, 0)
                                : Eigen::Vector2d(0, 0.5);
    s.place_m += 0.1 * s.speed_mps;
    s.off_m = off(s) + Eigen::Vector2d(noise(random), noise(random));
    s.sigma_m = 0.0005;
    out.push_back(s);
  }
  return out;
}

TEST(MotionFit, TellsScaleTurnAndDelayApart) {
  const auto scale =
      motion([](const MotionSample& s) { return Eigen::Vector2d(-0.01 * s.place_m.x(), 0); });
  EXPECT_NEAR(fit_axis(scale, 0).scale.value, -0.01, 0.001);
  EXPECT_GT(fit_axis(scale, 0).scale.sigmas(), 5);
  EXPECT_LT(std::abs(fit_axis(scale, 0).delay_s.value), 0.005);
  EXPECT_LT(std::abs(fit_axis(scale, 1).scale.value), 0.001);

  const auto late =
      motion([](const MotionSample& s) { return Eigen::Vector2d(0, 0.05 * s.speed_mps.y()); });
  EXPECT_NEAR(fit_axis(late, 1).delay_s.value, 0.05, 0.005);
  EXPECT_GT(fit_axis(late, 1).delay_s.sigmas(), 5);
  EXPECT_LT(std::abs(fit_axis(late, 1).scale.value), 0.002);

  const double skew = 0.2 * kDegree;
  const auto turned = motion([&](const MotionSample& s) {
    return Eigen::Vector2d(skew * s.place_m.y(), -skew * s.place_m.x());
  });
  EXPECT_NEAR(fit_axis(turned, 0).turn.value, skew, 0.1 * skew);
  EXPECT_NEAR(fit_axis(turned, 1).turn.value, -skew, 0.1 * skew);
}

TEST(MotionFit, SaysNothingOfWhatTheMotionDoesNotTell) {
  std::vector<MotionSample> straight;
  for (int i = 0; i < 40; ++i) {
    MotionSample s;
    s.place_m = {0.05 * i, 0};
    s.speed_mps = {0.5, 0};
    s.sigma_m = 0.0005;
    straight.push_back(s);
  }
  EXPECT_GT(fit_axis(straight, 0).delay_s.sigma, 0.02) << "at one speed a delay is a place";
  EXPECT_GT(fit_axis(straight, 0).turn.sigma, 0.05);
  EXPECT_LT(fit_axis(straight, 0).scale.sigma, 0.003);
}

TEST(MotionFit, ASwayingCameraIsNoFault) {
  // 1 cm with a period of 3 s, over 8 s.
  const auto swaying = motion([](const MotionSample& s) {
    return Eigen::Vector2d(0.01 * std::sin(2 * s.time_s), 0.01 * std::cos(2.6 * s.time_s));
  });
  for (const int axis : {0, 1}) {
    const AxisFit f = fit_axis(swaying, axis);
    for (const Figure* figure : {&f.scale, &f.turn, &f.delay_s}) EXPECT_LT(figure->sigmas(), 5);
  }
}

TEST(MotionFit, FindsAStep) {
  const auto jumped =
      motion([](const MotionSample& s) { return Eigen::Vector2d(s.time_s > 3 ? -0.1 : 0, 0); });
  const auto step = best_step(jumped, 0);
  ASSERT_TRUE(step);
  EXPECT_NEAR(step->size_m, 0.1, 0.005);
  EXPECT_NEAR(jumped[step->before].time_s, 3.1, 0.15);
  EXPECT_LT(step->rest_m, 0.3 * fit_axis(jumped, 0).rest_m);
}

TEST(Misfit, EverySuspectHasAName) {
  for (int i = 0; i <= static_cast<int>(Suspect::kMotion); ++i) {
    const Misfit m{static_cast<Suspect>(i), WatchState::kWrong, {0.01, 0.001}};
    EXPECT_GT(std::string(name_of(m.suspect)).size(), 2U);
    EXPECT_LT(text_of(m).size(), 200U) << text_of(m);
  }
  EXPECT_FALSE(is_of_positions(Suspect::kRoll));
  EXPECT_TRUE(is_of_positions(Suspect::kTurned));
}

}  // namespace
}  // namespace crane
