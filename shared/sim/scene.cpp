#include "sim/scene.hpp"

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
  c.rig.T_body_right.translation() = Eigen::Vector3d(baseline, 0, 0);
  c.rig.T_body_right.linear() = rotation(right_rotation);
  // Looking down: image x along the runway, image y against the bridge.
  Eigen::Matrix3d down;
  down << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  c.rig.T_map_camera_at_zero.linear() = rotation(tilt) * down;
  c.rig.T_map_camera_at_zero.translation() = Eigen::Vector3d(0, 0, height);
}

void read_motion(YamlReader y, SceneMotion& m) {
  int kind = 0;
  y.choice("kind", {"positions", "lap"}, kind);
  m.continuous = kind == 1;
  for (YamlReader& point : y.items("points")) {
    Eigen::Vector2d p(0, 0);
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

}  // namespace

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
  if (auto done = y->finish(); !done) return done.error();
  if (auto usable = check_rig(scene.camera.rig, path + " camera"); !usable) return usable.error();
  return scene;
}

}  // namespace crane
