// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "sim/scene_things.hpp"

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
  y.number("exposure_right", c.exposure_right, 0, 100);
  y.number("vignette", c.vignette, 0, 1);
  y.number("exposure_s", c.exposure_s, 0, 1);
  y.number("readout_s", c.readout_s, 0, 1);
  y.number("full_well_e", c.full_well_e, 0, 1e7);
  y.number("read_noise_e", c.read_noise_e, 0, 1e5);
  y.number("gain", c.gain, 0, 1000);
  y.integer("bits", c.bits, 8, 12);
  if (c.bits != 8 && (c.bits != 12 || c.colour)) y.problem("bits", "is 8, or 12 without colour");
  y.integer("dust", c.dust, 0, 1000);
  y.integer("drops", c.drops, 0, 1000);
  y.number("dust_radius_px", c.dust_radius_px, 1, 1000);
  y.number("dust_dark", c.dust_dark, 0, 1);
  y.number("drop_radius_px", c.drop_radius_px, 1, 1000);
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
  y.number("repeat_s", m.repeat_s, 0, 36'000);
  if (m.repeat_s > 0 && !m.times_s.empty() && m.repeat_s < m.times_s.back())
    y.problem("repeat_s", "ends before the last point is reached");
}

void read_quick(YamlReader y, Scene& scene) {
  std::vector<double> resolution = {0, 0};
  int frames = 6;
  y.numbers("resolution", resolution, 2);
  y.integer("frames", frames, 1, 10'000);
  const CameraModel& c = scene.camera.rig.left;
  if (resolution[0] > c.width || resolution[1] > c.height)
    y.problem("resolution", "is larger than the camera's");
  scene.quick.width = static_cast<std::uint32_t>(resolution[0]);
  scene.quick.height = static_cast<std::uint32_t>(resolution[1]);
  scene.quick.frames = static_cast<std::size_t>(frames);
}

}  // namespace

Result<Scene> read_scene(const std::string& path) {
  auto y = YamlReader::from_file(path);
  if (!y) return y.error();
  const std::string folder = std::filesystem::path(path).parent_path();
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
  r.number("rail_y_m", scene.rangefinder.rail_y_m, -200, 200);
  r.number("rail_span_m", scene.rangefinder.rail_span_m, -200, 200);
  for (YamlReader& item : y->items("materials")) {
    std::string name;
    item.text("name", name, true);
    scene.materials[name] = read_material(item, folder);
  }
  y->number("ambient", scene.ambient, 0, 10);
  YamlReader daylight = y->section("daylight");
  daylight.number("swing", scene.daylight.swing, 0, 1);
  daylight.number("period_s", scene.daylight.period_s, 0.1, 36'000);
  read_untold(y->section("untold"), scene.untold);
  y->text("floor", scene.floor_material, true);
  if (!scene.materials.contains(scene.floor_material)) y->problem("floor", "names no material");
  for (YamlReader& item : y->items("lamps")) {
    Lamp lamp;
    std::vector<double> centre = {0, 0, 4};
    std::vector<double> size = {0.4, 0.4};
    item.numbers("centre", centre, 3, true);
    item.numbers("size", size, 2);
    item.number("power", lamp.power, 0, 1e5);
    item.number("from_s", lamp.from_s, 0, 36'000);
    item.number("until_s", lamp.until_s, 0, 36'000);
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
  for (YamlReader& item : y->items("pits")) scene.pits.push_back(read_pit(item));
  std::vector<std::string> faults;
  y->texts("faults", faults);
  for (const std::string& text : faults) {
    auto fault = parse_fault(text);
    if (fault)
      scene.faults.push_back(*fault);
    else
      y->problem("faults", fault.error().text());
  }
  scene.bound = read_bound(y->section("bound"));
  read_quick(y->section("quick"), scene);
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
