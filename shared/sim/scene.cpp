#include "sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "config/yaml_reader.hpp"

namespace crane {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Eigen::Matrix3d rotation(const std::vector<double>& degrees_xyz) {
  return (Eigen::AngleAxisd(degrees_xyz[2] * kDegree, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(degrees_xyz[1] * kDegree, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(degrees_xyz[0] * kDegree, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

void read_camera(YamlReader y, SceneCamera& c) {
  std::vector<double> resolution = {1280, 720};
  std::vector<double> distortion = {0, 0, 0, 0};
  std::vector<double> tilt = {0, 0, 0};
  std::vector<double> right_rotation = {0, 0, 0};
  double f = 700;
  double baseline = 0.12;
  double height = 2;
  y.numbers("resolution", resolution, 2);
  y.number("f_px", f, 10, 20'000);
  y.number("baseline_m", baseline, 0.01, 5);
  y.number("height_m", height, 0.3, 100);
  y.numbers("distortion", distortion, 4);
  y.numbers("tilt_deg", tilt, 3);
  y.numbers("right_rotation_deg", right_rotation, 3);
  y.number("exposure", c.exposure, 0, 100);
  y.number("noise_grey", c.noise_grey, 0, 100);
  y.flag("colour", c.colour);
  y.integer("samples", c.samples, 1, 64);
  if (resolution[0] < 16 || resolution[0] > 8192 || resolution[1] < 16 || resolution[1] > 8192)
    y.problem("resolution", "is outside 16 .. 8192");
  CameraModel m;
  m.width = static_cast<std::uint32_t>(resolution[0]);
  m.height = static_cast<std::uint32_t>(resolution[1]);
  m.fx_px = m.fy_px = f;
  m.cx_px = (resolution[0] - 1) / 2;
  m.cy_px = (resolution[1] - 1) / 2;
  m.k1 = distortion[0], m.k2 = distortion[1], m.p1 = distortion[2], m.p2 = distortion[3];
  c.rig.left = c.rig.right = m;
  c.rig.T_left_right.translation() = Eigen::Vector3d(baseline, 0, 0);
  c.rig.T_left_right.linear() = rotation(right_rotation);
  // Looking down: image x along the runway, image y against the bridge.
  Eigen::Matrix3d down;
  down << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  c.rig.T_map_camera_at_zero.linear() = rotation(tilt) * down;
  c.rig.T_map_camera_at_zero.translation() = Eigen::Vector3d(0, 0, height);
}

void read_motion(YamlReader y, SceneMotion& m) {
  int kind = 0;
  y.choice("kind", {"positions", "lap", "timed"}, kind);
  m.continuous = kind != 0;
  for (YamlReader& point : y.items("points")) {
    Eigen::Vector2d p(0, 0);
    if (kind == 2) {
      double time = 0;
      point.number("time_s", time, 0, 36'000, true);
      if (!m.times_s.empty() && time <= m.times_s.back())
        point.problem("time_s", "must grow from point to point");
      m.times_s.push_back(time);
    }
    point.number("cart", p.x(), -1e4, 1e4, true);
    point.number("trolley", p.y(), -1e4, 1e4, true);
    m.points.push_back(p);
  }
  if (m.points.empty()) y.problem("points", "needs at least one point {cart: .., trolley: ..}");
  if (m.continuous && m.points.size() < 2) y.problem("points", "a lap needs two points");
  y.number("interval_s", m.interval_s, 0.01, 1000);
  y.number("speed_mps", m.speed_mps, 0.001, 20);
  y.number("rate_hz", m.rate_hz, 0.1, 120);
  y.number("duration_s", m.duration_s, 0.1, 36'000);
}

Material read_material(YamlReader& y) {
  Material m;
  std::vector<double> colour = {0.5, 0.5, 0.5};
  y.numbers("colour", colour, 3);
  m.colour = Eigen::Vector3d(colour[0], colour[1], colour[2]).cast<float>();
  y.number("texture", m.texture, 0, 1);
  y.number("grain_m", m.grain_m, 1e-4, 10);
  y.number("gloss", m.gloss, 0, 1);
  y.number("shininess", m.shininess, 1, 10'000);
  return m;
}

SceneObstacle read_obstacle(YamlReader& y) {
  SceneObstacle o;
  TrueObstacle& s = o.shape;
  std::vector<double> size = {0, 0};
  const std::vector<std::string> kinds = {"box", "cylinder", "pipe", "chair"};
  int kind = 0;
  y.text("name", s.name, true);
  y.choice("kind", kinds, kind);
  s.kind = kinds[static_cast<std::size_t>(kind)];
  y.text("material", o.material, true);
  y.number("x", s.x_m, -1e4, 1e4, true);
  y.number("y", s.y_m, -1e4, 1e4, true);
  y.number("base", o.base_m, 0, 100);
  y.number("height", s.height_m, 0.001, 100, true);
  y.number("seat_height", s.seat_height_m, 0, 100);
  y.number("radius", s.radius_m, 0, 100);
  y.number("length", s.length_m, 0, 1000);
  y.numbers("size", size, 2);
  y.number("yaw", s.yaw_rad, -10, 10);
  y.number("from_s", o.from_s, 0, 36'000);
  y.number("until_s", o.until_s, 0, 36'000);
  s.size_x_m = size[0];
  s.size_y_m = size[1];
  if ((s.kind == "box" || s.kind == "chair") && !(size[0] > 0 && size[1] > 0))
    y.problem("size", "must be [x, y] in metres");
  if ((s.kind == "cylinder" || s.kind == "pipe") && !(s.radius_m > 0))
    y.problem("radius", "must be given");
  if (s.kind == "pipe" && !(s.length_m > 0)) y.problem("length", "must be given");
  if (s.kind == "chair" && !(s.seat_height_m > 0 && s.seat_height_m < s.height_m))
    y.problem("seat_height", "must lie between 0 and height");
  return o;
}

/// Nothing where no move is given.
std::optional<SceneHoist> read_hoist(YamlReader y) {
  SceneHoist h;
  std::vector<double> offset = {0, 0};
  std::vector<double> hook = {0.1, 0.1, 0.15};
  std::vector<double> load = {0, 0, 0};
  y.numbers("offset", offset, 2);
  y.number("rope_top_m", h.rope_top_m, 0.1, 200);
  y.number("rope_radius_m", h.rope_radius_m, 0.001, 2);
  y.numbers("hook_size", hook, 3);
  y.text("material", h.material);
  y.numbers("load_size", load, 3);
  y.number("load_yaw", h.load_yaw_rad, -10, 10);
  y.number("sling_m", h.sling_m, 0, 20);
  y.text("load_material", h.load_material);
  y.number("sway_m", h.sway_m, 0, 5);
  y.number("sway_period_s", h.sway_period_s, 0.1, 60);
  y.number("rate_hz", h.rate_hz, 0.1, 200);
  for (YamlReader& item : y.items("moves")) {
    SceneHoist::Move m;
    item.number("time_s", m.time_s, 0, 36'000, true);
    item.number("hook_m", m.hook_m, -10, 200, true);
    item.flag("load", m.load);
    if (!h.moves.empty() && m.time_s <= h.moves.back().time_s)
      item.problem("time_s", "must grow from move to move");
    h.moves.push_back(m);
  }
  if (h.moves.empty()) return std::nullopt;
  h.offset_m = {offset[0], offset[1]};
  h.hook_size_m = {hook[0], hook[1], hook[2]};
  h.load_size_m = {load[0], load[1], load[2]};
  return h;
}

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

}  // namespace

Eigen::Vector2d gantry_at(const SceneMotion& m, double seconds) {
  const double time = std::max(0.0, seconds);
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

std::vector<std::optional<SceneObstacle>> obstacles_at(const Scene& scene, double seconds) {
  std::vector<std::optional<SceneObstacle>> out;
  for (const SceneObstacle& o : scene.obstacles)
    out.push_back(o.from_s <= seconds && seconds < o.until_s ? std::optional(o) : std::nullopt);
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

Result<Scene> read_scene(const std::string& path) {
  auto y = YamlReader::from_file(path);
  if (!y) return y.error();
  Scene scene;
  int seed = 1;
  y->text("name", scene.name, true);
  y->integer("seed", seed, 0, 2'000'000'000);
  scene.seed = static_cast<std::uint64_t>(seed);
  read_camera(y->section("camera", true), scene.camera);
  read_motion(y->section("motion", true), scene.motion);
  YamlReader r = y->section("rangefinder");
  r.number("sigma_m", scene.rangefinder.sigma_m, 0, 1);
  r.number("rate_hz", scene.rangefinder.rate_hz, 1, 1000);
  r.number("delay_ms", scene.rangefinder.delay_ms, 0, 1000);
  for (YamlReader& item : y->items("materials")) {
    std::string name;
    item.text("name", name, true);
    scene.materials[name] = read_material(item);
  }
  y->number("ambient", scene.ambient, 0, 10);
  y->text("floor", scene.floor_material, true);
  if (!scene.materials.contains(scene.floor_material)) y->problem("floor", "names no material");
  for (YamlReader& item : y->items("lamps")) {
    Lamp lamp;
    std::vector<double> centre = {0, 0, 4};
    std::vector<double> size = {0.4, 0.4};
    item.numbers("centre", centre, 3, true);
    item.numbers("size", size, 2);
    item.number("power", lamp.power, 0, 1e5);
    lamp.centre = {centre[0], centre[1], centre[2]};
    lamp.size_x_m = size[0];
    lamp.size_y_m = size[1];
    scene.lamps.push_back(lamp);
  }
  for (YamlReader& item : y->items("obstacles")) {
    scene.obstacles.push_back(read_obstacle(item));
    if (!scene.materials.contains(scene.obstacles.back().material))
      item.problem("material", "is not in materials");
  }
  scene.hoist = read_hoist(y->section("hoist"));
  if (scene.hoist && (!scene.materials.contains(scene.hoist->material) ||
                      (scene.hoist->load_size_m.maxCoeff() > 0 &&
                       !scene.materials.contains(scene.hoist->load_material))))
    y->problem("hoist", "names no material, or no load_material");
  if (auto done = y->finish(); !done) return done.error();
  if (auto usable = check_rig(scene.camera.rig, path + " camera"); !usable) return usable.error();
  return scene;
}

}  // namespace crane
