// SPDX-License-Identifier: Apache-2.0
#include "sim/scene_things.hpp"

#include <algorithm>
#include <filesystem>

namespace crane {
namespace {

using Pattern = Material::Pattern;

/// From one point to another; height is found from them.
void read_line(YamlReader& y, TrueObstacle& s) {
  std::vector<double> from = {0, 0, 0}, to = {0, 0, 0};
  y.numbers("from", from, 3, true);
  y.numbers("to", to, 3, true);
  y.number("sag", s.sag_m, 0, 100);
  if (from == to) y.problem("to", "is where it comes from");
  std::copy(from.begin(), from.end(), s.from_m.begin());
  std::copy(to.begin(), to.end(), s.to_m.begin());
  s.x_m = (from[0] + to[0]) / 2;
  s.y_m = (from[1] + to[1]) / 2;
}

/// Quantities with _min and _max; of single obstacles too.
SceneBound::Limits read_limits(YamlReader& y) {
  SceneBound::Limits out;
  for (const char* quantity :
       {"coverage", "unsafe", "phantom", "found", "unknown", "low", "cleared", "hollow",
        "wrong_clear", "height_error_m", "frames_used"}) {
    for (const bool least : {true, false}) {
      const std::string key = std::string(quantity) + (least ? "_min" : "_max");
      double value = 0;
      if (!y.has(key)) continue;
      y.number(key, value, 0, 1e9);
      (least ? out.least : out.most)[quantity] = value;
    }
  }
  return out;
}

}  // namespace

Material read_material(YamlReader& y, const std::string& folder) {
  Material m;
  std::vector<double> colour = {0.5, 0.5, 0.5};
  y.numbers("colour", colour, 3);
  m.colour = Eigen::Vector3d(colour[0], colour[1], colour[2]).cast<float>();
  y.number("texture", m.texture, 0, 1);
  y.number("grain_m", m.grain_m, 1e-4, 10);
  y.number("gloss", m.gloss, 0, 1);
  y.number("shininess", m.shininess, 1, 10'000);
  y.number("mirror", m.mirror, 0, 1);
  y.number("glass", m.glass, 0, 1);
  if (m.mirror + m.glass > 1) y.problem("glass", "and mirror are more than all of the light");
  const std::vector<Pattern> patterns = {Pattern::kNone,     Pattern::kChecker,  Pattern::kGrating,
                                         Pattern::kStripesX, Pattern::kStripesY, Pattern::kBricks,
                                         Pattern::kDots};
  int pattern = 0;
  y.choice("pattern", {"none", "checker", "grating", "stripes_x", "stripes_y", "bricks", "dots"},
           pattern);
  m.pattern = patterns[static_cast<std::size_t>(pattern)];
  y.number("period_m", m.period_m, 0.001, 100);
  y.number("pattern_dark", m.pattern_dark, 0, 1);
  y.number("photo_m", m.photo_m, 0.01, 1000);
  std::string photo;
  y.text("photo", photo);
  if (photo.empty()) return m;
  auto image = read_image((std::filesystem::path(folder) / photo).string(), 100'000'000);
  if (image)
    m.photo = std::make_shared<const Image>(*std::move(image));
  else
    y.problem("photo", image.error().text());
  return m;
}

SceneObstacle read_obstacle(YamlReader& y) {
  SceneObstacle o;
  TrueObstacle& s = o.shape;
  std::vector<double> size = {0, 0};
  const std::vector<std::string> kinds = {"box", "cylinder", "pipe",  "chair",
                                          "rod", "cable",    "chain", "wedge"};
  int kind = 0;
  y.text("name", s.name, true);
  y.choice("kind", kinds, kind);
  s.kind = kinds[static_cast<std::size_t>(kind)];
  y.text("material", o.material, true);
  const bool line = s.kind == "rod" || s.kind == "cable" || s.kind == "chain";
  if (line) read_line(y, s);
  y.number("x", s.x_m, -1e4, 1e4, !line);
  y.number("y", s.y_m, -1e4, 1e4, !line);
  y.number("base", o.base_m, 0, 100);
  y.number("height", s.height_m, 0.001, 100, !line);
  y.number("low", s.low_m, 0, 100);
  y.number("seat_height", s.seat_height_m, 0, 100);
  y.number("radius", s.radius_m, 0, 100);
  y.number("length", s.length_m, 0, 1000);
  y.numbers("size", size, 2);
  y.number("yaw", s.yaw_rad, -10, 10);
  y.number("from_s", o.from_s, 0, 36'000);
  y.number("until_s", o.until_s, 0, 36'000);
  for (YamlReader& item : y.items("track")) {
    SceneObstacle::Step step;
    item.number("time_s", step.time_s, 0, 36'000, true);
    item.number("x", step.x_m, -1e4, 1e4, true);
    item.number("y", step.y_m, -1e4, 1e4, true);
    if (!o.track.empty() && step.time_s <= o.track.back().time_s)
      item.problem("time_s", "must grow from step to step");
    o.track.push_back(step);
  }
  if (line && !o.track.empty()) y.problem("track", "is for things with an x and y");
  s.size_x_m = size[0];
  s.size_y_m = size[1];
  if (line) s.height_m = std::max(s.from_m[2], s.to_m[2]) + s.radius_m;
  if (s.kind == "box" || s.kind == "cylinder" || s.kind == "wedge") s.base_m = o.base_m;
  if (s.kind == "wedge" && !(s.low_m >= o.base_m && s.low_m < s.height_m))
    y.problem("low", "of a wedge lies between base and height");
  if ((s.kind == "box" || s.kind == "chair" || s.kind == "wedge") && !(size[0] > 0 && size[1] > 0))
    y.problem("size", "must be [x, y] in metres");
  if ((s.kind == "cylinder" || s.kind == "pipe" || line) && !(s.radius_m > 0))
    y.problem("radius", "must be given");
  if (s.kind == "pipe" && !(s.length_m > 0)) y.problem("length", "must be given");
  if (s.kind == "chair" && !(s.seat_height_m > 0 && s.seat_height_m < s.height_m))
    y.problem("seat_height", "must lie between 0 and height");
  return o;
}

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

ScenePit read_pit(YamlReader& y) {
  ScenePit pit;
  std::vector<double> from = {0, 0}, to = {0, 0};
  y.numbers("from", from, 2, true);
  y.numbers("to", to, 2, true);
  y.number("depth", pit.depth_m, 0.001, 60, true);
  pit.x0_m = from[0], pit.y0_m = from[1], pit.x1_m = to[0], pit.y1_m = to[1];
  if (!(pit.x0_m < pit.x1_m && pit.y0_m < pit.y1_m))
    y.problem("to", "must be right of and above from");
  return pit;
}

void read_untold(YamlReader y, UntoldMotion& m) {
  y.number("skew_deg", m.skew_deg, -45, 45);
  y.number("skew_deg_per_m", m.skew_deg_per_m, -10, 10);
  y.number("sway_roll_deg", m.sway_roll_deg, 0, 45);
  y.number("sway_pitch_deg", m.sway_pitch_deg, 0, 45);
  y.number("sway_period_s", m.sway_period_s, 0.01, 600);
  y.number("vibration_deg", m.vibration_deg, 0, 10);
  y.number("vibration_m", m.vibration_m, 0, 1);
  y.number("vibration_hz", m.vibration_hz, 0.01, 1000);
}

SceneBound read_bound(YamlReader y) {
  SceneBound bound;
  bound.limits.push_back(read_limits(y));
  for (YamlReader& item : y.items("obstacles")) {
    std::string name;
    item.text("name", name, true);
    bound.limits.push_back(read_limits(item));
    bound.limits.back().obstacle = name;
  }
  return bound;
}

}  // namespace crane
