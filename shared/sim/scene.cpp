// SPDX-License-Identifier: Apache-2.0
#include "sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crane {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

SceneObstacle hanging(const std::string& name, const std::string& material,
                      const Eigen::Vector2d& at, double base_m, double top_m) {
  SceneObstacle o;
  o.shape.name = name;
  o.material = material;
  o.shape.x_m = at.x();
  o.shape.y_m = at.y();
  o.base_m = base_m;
  o.shape.height_m = top_m;
  return o;
}

/// To where its track says it is.
void move_along(SceneObstacle& o, double seconds) {
  const std::vector<SceneObstacle::Step>& track = o.track;
  std::size_t i = 0;
  while (i + 1 < track.size() && track[i + 1].time_s <= seconds) ++i;
  SceneObstacle::Step at = track[i];
  if (i + 1 < track.size() && seconds > at.time_s) {
    const SceneObstacle::Step& next = track[i + 1];
    const double share = (seconds - at.time_s) / (next.time_s - at.time_s);
    at.x_m += share * (next.x_m - at.x_m);
    at.y_m += share * (next.y_m - at.y_m);
  }
  o.shape.x_m = at.x_m;
  o.shape.y_m = at.y_m;
  o.texture_origin = Eigen::Vector3d(at.x_m - track[0].x_m, at.y_m - track[0].y_m, 0).cast<float>();
}

}  // namespace

Eigen::Isometry3d untold_at(const UntoldMotion& m, const Eigen::Vector2d& gantry, double seconds) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (!m.any()) return T;
  const double sway = 2 * std::numbers::pi * seconds / m.sway_period_s;
  const double shake = 2 * std::numbers::pi * seconds * m.vibration_hz;
  const double yaw = m.skew_deg + m.skew_deg_per_m * gantry.y();
  const double pitch = m.sway_pitch_deg * std::sin(sway) + m.vibration_deg * std::sin(shake);
  const double roll =
      m.sway_roll_deg * std::sin(1.3 * sway + 0.5) + m.vibration_deg * std::sin(1.1 * shake + 1);
  T.linear() = (Eigen::AngleAxisd(yaw * kDegree, Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(pitch * kDegree, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(roll * kDegree, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  T.translation() = m.vibration_m * Eigen::Vector3d(std::sin(shake), std::sin(1.2 * shake + 2),
                                                    0.3 * std::sin(0.9 * shake));
  return T;
}

Scene make_quick(Scene scene) {
  const SceneQuick& quick = scene.quick;
  for (CameraModel* c : {&scene.camera.rig.left, &scene.camera.rig.right}) {
    c->cx_px -= (double(c->width) - quick.width) / 2;
    c->cy_px -= (double(c->height) - quick.height) / 2;
    c->width = quick.width;
    c->height = quick.height;
  }
  SceneMotion& m = scene.motion;
  if (m.continuous)
    m.duration_s = std::min(m.duration_s, double(quick.frames) / m.rate_hz);
  else
    m.points.resize(std::min(m.points.size(), quick.frames));
  return scene;
}

double within_round(const SceneMotion& m, double seconds) {
  const double time = std::max(0.0, seconds);
  return m.repeat_s > 0 ? std::fmod(time, m.repeat_s) : time;
}

Eigen::Vector2d gantry_at(const SceneMotion& m, double seconds) {
  const double time = m.times_s.empty() ? std::max(0.0, seconds) : within_round(m, seconds);
  const std::size_t count = m.points.size();
  if (!m.continuous)
    return m.points[std::min(static_cast<std::size_t>(std::round(time / m.interval_s)), count - 1)];
  const auto part = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, double share) {
    return Eigen::Vector2d(a + share * (b - a));
  };
  if (!m.times_s.empty()) {
    for (std::size_t i = 0; i + 1 < count; ++i)
      if (time < m.times_s[i + 1])
        return part(m.points[i], m.points[i + 1],
                    std::max(0.0, (time - m.times_s[i]) / (m.times_s[i + 1] - m.times_s[i])));
    return m.points.back();
  }
  const auto next = [&](std::size_t i) { return m.points[(i + 1) % count]; };
  double round_m = 0;
  for (std::size_t i = 0; i < count; ++i) round_m += (next(i) - m.points[i]).norm();
  double left = std::fmod(time * m.speed_mps, round_m);
  for (std::size_t i = 0; i < count; ++i) {
    const double length = (next(i) - m.points[i]).norm();
    if (left <= length) return part(m.points[i], next(i), length > 0 ? left / length : 0);
    left -= length;
  }
  return m.points.front();
}

HoistPose hoist_at(const SceneHoist& h, double seconds) {
  HoistPose pose;
  pose.sway_m.x() = h.sway_m * std::sin(2 * std::numbers::pi * seconds / h.sway_period_s);
  pose.hook_m = h.moves.front().hook_m;
  for (std::size_t i = 0; i < h.moves.size() && seconds >= h.moves[i].time_s; ++i) {
    const SceneHoist::Move& from = h.moves[i];
    pose.load = from.load;
    pose.hook_m = from.hook_m;
    if (i + 1 == h.moves.size()) break;
    const SceneHoist::Move& to = h.moves[i + 1];
    const double share = std::min(1.0, (seconds - from.time_s) / (to.time_s - from.time_s));
    pose.hook_m += share * (to.hook_m - from.hook_m);
  }
  return pose;
}

std::vector<std::optional<SceneObstacle>> obstacles_at(const Scene& scene, double since_start) {
  const double seconds = within_round(scene.motion, since_start);
  std::vector<std::optional<SceneObstacle>> out;
  for (const SceneObstacle& o : scene.obstacles) {
    out.push_back(o.from_s <= seconds && seconds < o.until_s ? std::optional(o) : std::nullopt);
    if (out.back() && !o.track.empty()) move_along(*out.back(), seconds);
  }
  if (!scene.hoist) return out;
  const SceneHoist& h = *scene.hoist;
  const HoistPose pose = hoist_at(h, seconds);
  const Eigen::Vector2d at = gantry_at(scene.motion, seconds) + h.offset_m + pose.sway_m;
  const double hook_top = pose.hook_m + h.hook_size_m.z();
  SceneObstacle rope = hanging("rope", h.material, at, hook_top, std::max(h.rope_top_m, hook_top));
  rope.shape.kind = "cylinder";
  rope.shape.radius_m = h.rope_radius_m;
  out.emplace_back(rope);
  SceneObstacle hook = hanging("hook", h.material, at, pose.hook_m, hook_top);
  hook.shape.kind = "box";
  hook.shape.size_x_m = h.hook_size_m.x();
  hook.shape.size_y_m = h.hook_size_m.y();
  out.emplace_back(hook);
  const double load_top = pose.hook_m - h.sling_m;
  SceneObstacle load = hanging("load", h.load_material, at, load_top - h.load_size_m.z(), load_top);
  load.shape.kind = "box";
  load.shape.size_x_m = h.load_size_m.x();
  load.shape.size_y_m = h.load_size_m.y();
  load.shape.yaw_rad = h.load_yaw_rad;
  out.push_back(pose.load && h.load_size_m.minCoeff() > 0 ? std::optional(load) : std::nullopt);
  return out;
}

}  // namespace crane
