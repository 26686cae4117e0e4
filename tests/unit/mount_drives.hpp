// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "mount/mount_calibration.hpp"

namespace crane::test {

/// A drive as sightings and readings, without images: its truth is exact.
struct DriveRecipe {
  double height_m = 2, tilt_x_deg = 0, tilt_y_deg = 0, yaw_deg = 0;
  double told_yaw_deg = 0, told_height_m = 2;
  std::array<double, 2> scale{1, 1}, delay_s{0, 0};  ///< of readings: too long by, later by
  std::array<int, 2> direction{1, 1};
  bool drive_bridge = true, drive_trolley = true, constant_speed = false;
  double pixel_noise = 0.08, reading_noise_m = 0.001;
  Eigen::Vector2d floor_slope = Eigen::Vector2d::Zero();
  double skew = 0;
  double objects = 0;  ///< share of the points that stand 0.5 m high
  double load = 0;     ///< share of a frame's points that come along with the camera
  double walkers = 0;  ///< share of the points that move by themselves
  Eigen::Vector2d eye_m = Eigen::Vector2d::Zero();  ///< camera minus (bridge, trolley)
  /// Points of a hook: its lowest point's height, and where it hangs from bridge and trolley.
  double hook_height_m = 0;
  Eigen::Vector2d hook_m = Eigen::Vector2d::Zero();
  /// Two rangefinders of the bridge, the first at map y rail_y_m; its skew, tangent about -z,
  /// swings by this about `skew`. 0: one.
  double rail_span_m = 0, rail_y_m = 0, skew_swing = 0;
  int second_direction = 1;
  double second_offset_m = 0;
  double seconds = 30, frames_hz = 8, readings_hz = 20;
  std::size_t points_seen = 120;
  unsigned seed = 1;
  std::function<void(std::vector<RecordedDistance>& cart)> spoil_cart;
};

/// Bridge, trolley [m]: at rest, there and back, one after the other and together, at two speeds.
inline Eigen::Vector2d drive_at(const DriveRecipe& r, double t) {
  static const std::vector<std::array<double, 3>> kWay = {
      {0, 1, 1},      {1, 1, 1},      {5, 2.5, 1},    {6, 2.5, 1},    {9, 2.5, 2.2},
      {10, 2.5, 2.2}, {13, 1.2, 2.2}, {14, 1.2, 2.2}, {18, 1.2, 1.0}, {18.5, 1.2, 1.0},
      {24, 2.6, 2.1}, {25, 2.6, 2.1}, {29, 1, 1},     {60, 1, 1}};
  Eigen::Vector2d p = Eigen::Vector2d(1, 1);
  if (r.constant_speed) {
    p += 0.05 * t * Eigen::Vector2d(1, 0.9);
  } else {
    for (std::size_t i = 0; i + 1 < kWay.size(); ++i)
      if (t >= kWay[i][0] && t < kWay[i + 1][0]) {
        const double x = (t - kWay[i][0]) / (kWay[i + 1][0] - kWay[i][0]);
        const double share = x * x * (3 - 2 * x);  // it does not jump in speed
        p.x() = kWay[i][1] + share * (kWay[i + 1][1] - kWay[i][1]);
        p.y() = kWay[i][2] + share * (kWay[i + 1][2] - kWay[i][2]);
      }
  }
  if (!r.drive_bridge) p.x() = 1;
  if (!r.drive_trolley) p.y() = 1;
  return p;
}

/// How skew the bridge is: metres of map x by metre of map y.
inline double skew_at(const DriveRecipe& r, double t) {
  return r.skew + r.skew_swing * std::sin(2 * std::numbers::pi * t / 11);
}

inline Eigen::Matrix3d camera_rotation(double tilt_x_deg, double tilt_y_deg, double yaw_deg) {
  constexpr double kRad = std::numbers::pi / 180;
  const Eigen::Vector3d down =
      Eigen::Vector3d(std::tan(tilt_x_deg * kRad), std::tan(tilt_y_deg * kRad), -1).normalized();
  Eigen::Vector3d x(std::cos(yaw_deg * kRad), std::sin(yaw_deg * kRad), 0);
  x.z() = -(x.x() * down.x() + x.y() * down.y()) / down.z();
  x.normalize();
  Eigen::Matrix3d R;
  R.col(0) = x;
  R.col(1) = down.cross(x);
  R.col(2) = down;
  return R;
}

inline Drive make_drive(const DriveRecipe& r) {
  Drive d;
  RectifiedCamera& c = d.camera;
  c.width = 1280, c.height = 720, c.f_px = 700, c.cx_px = 640, c.cy_px = 360, c.baseline_m = 0.12;
  for (CameraModel* m : {&d.rig.left, &d.rig.right}) {
    m->width = 1280, m->height = 720, m->fx_px = m->fy_px = 700, m->cx_px = 640, m->cy_px = 360;
  }
  d.rig.T_left_right.translation().x() = 0.12;
  d.rig.T_map_camera_at_zero.linear() = camera_rotation(0, 0, r.told_yaw_deg);
  d.rig.T_map_camera_at_zero.translation() << r.eye_m, r.told_height_m;
  d.told_height_m = r.told_height_m;
  const Eigen::Matrix3d R_at_zero = camera_rotation(r.tilt_x_deg, r.tilt_y_deg, r.yaw_deg);
  std::mt19937 random(r.seed);
  std::normal_distribution<double> noise(0, 1);
  std::uniform_real_distribution<double> one(0, 1);
  const TimeNs start = 1'700'000'000'000'000'000;
  const auto at_time = [&](double s) { return start + TimeNs(std::llround(s * 1e9)); };
  for (double t = 0.003; t < r.seconds; t += 1 / r.readings_hz) {
    const Eigen::Vector2d p = drive_at(r, t);
    for (const int k : {0, 1}) {
      const auto i = std::size_t(k);
      const double length = r.direction[i] > 0 ? p[k] : 12 - p[k];
      (k == 0 ? d.cart : d.trolley)
          .push_back(
              {at_time(t + r.delay_s[i]), r.scale[i] * length + r.reading_noise_m * noise(random)});
    }
  }
  for (double t = 0.011; r.rail_span_m != 0 && t < r.seconds; t += 1 / r.readings_hz) {
    const double x = drive_at(r, t).x() + skew_at(r, t) * r.rail_span_m;
    d.cart_second.push_back(
        {at_time(t + r.delay_s[0]), r.scale[0] * (r.second_direction * (x - r.second_offset_m)) +
                                        r.reading_noise_m * noise(random)});
  }
  if (r.spoil_cart) r.spoil_cart(d.cart);
  struct World {
    Eigen::Vector3d p;
    Eigen::Vector2d speed;
    std::size_t track, last_frame;
  };
  std::vector<World> world;
  for (int i = 0; i < 9000; ++i) {
    World w;
    w.p = {12 * one(random) - 4, 12 * one(random) - 4, 0};
    w.p.z() = r.floor_slope.dot(w.p.head<2>() - Eigen::Vector2d(1.8, 1.6)) + 0.002 * noise(random);
    if (one(random) < r.objects) w.p.z() += 0.5;
    w.speed.setZero();
    if (one(random) < r.walkers) w.speed = {0.3 * noise(random), 0.3 * noise(random)};
    w.track = 0, w.last_frame = 1'000'000;
    world.push_back(w);
  }
  for (std::size_t n = 0; double(n) / r.frames_hz < r.seconds - 1; ++n) {
    const double t = double(n) / r.frames_hz;
    const Eigen::Vector2d g = drive_at(r, t);
    // One rangefinder alone sees the trolley's way run skew; two see the bridge itself turn.
    const bool rails = r.rail_span_m != 0;
    const double per_m = skew_at(r, t);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(rails ? -std::atan(per_m) : 0, Eigen::Vector3d::UnitZ())
            .toRotationMatrix();
    const Eigen::Matrix3d R = turn * R_at_zero;
    const Eigen::Vector3d trolley(g.x() + per_m * (g.y() - (rails ? r.rail_y_m : 0)), g.y(), 0);
    const Eigen::Vector3d eye =
        trolley + turn * Eigen::Vector3d(r.eye_m.x(), r.eye_m.y(), r.height_m);
    DriveFrame frame;
    frame.time = at_time(t);
    const auto see = [&](const Eigen::Vector3d& p, std::size_t track) {
      frame.sightings.push_back(
          {track, c.f_px * p.x() / p.z() + c.cx_px + r.pixel_noise * noise(random),
           c.f_px * p.y() / p.z() + c.cy_px + r.pixel_noise * noise(random),
           c.f_px * (p.x() - c.baseline_m) / p.z() + c.cx_px + r.pixel_noise * noise(random)});
    };
    const auto on_load = std::size_t(r.load * double(r.points_seen));
    for (std::size_t i = 0; i < on_load; ++i)
      see({0.3 + 0.01 * double(i % 20), 0.02 * double(i / 20), 1.2}, 100'000 + i);
    for (std::size_t i = 0; r.hook_height_m > 0 && i < 12; ++i) {
      const double a = 0.5 * double(i);
      const Eigen::Vector3d below(r.hook_m.x() + 0.04 * std::cos(a),
                                  r.hook_m.y() + 0.04 * std::sin(a),
                                  r.hook_height_m + 0.02 * double(i));
      see(R.transpose() * (trolley + turn * below - eye), 200'000 + i);
    }
    for (World& w : world) {
      if (frame.sightings.size() >= r.points_seen) break;
      Eigen::Vector3d place = w.p;
      place.head<2>() += t * w.speed;
      const Eigen::Vector3d p = R.transpose() * (place - eye);
      const double u = c.f_px * p.x() / p.z() + c.cx_px;
      const double v = c.f_px * p.y() / p.z() + c.cy_px;
      if (p.z() < 0.3 || u < 90 || v < 10 || u > 1270 || v > 710) continue;
      if (w.last_frame + 1 != n) w.track = d.tracks++;
      w.last_frame = n;
      see(p, w.track);
    }
    d.frames.push_back(std::move(frame));
  }
  for (DriveFrame& frame : d.frames)
    for (Sighting& s : frame.sightings)
      if (s.track >= 200'000)
        s.track = s.track - 200'000 + d.tracks;
      else if (s.track >= 100'000)
        s.track = s.track - 100'000 + d.tracks + 12;
  d.tracks += 12 + std::size_t(r.load * double(r.points_seen));
  d.recorded_frames = d.frames.size();
  return d;
}

}  // namespace crane::test
