// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <functional>
#include <numbers>

#include "experiments.hpp"

namespace crane::accuracy {
namespace {

constexpr double kVoxel = 0.02;

struct Variant {
  std::string name;
  std::function<Method(double value)> method;
};

/// One property, its values, and what they do to scene and method.
struct Sweep {
  std::string title, axis;
  std::vector<double> values;
  int digits;  ///< of the values
  std::function<void(Scene&, double value)> change;
  std::vector<Variant> variants;
  bool moving = false;  ///< a continuous lap; judged by where obstacles stand
};

std::vector<Variant> both() {
  return {{"paper", [](double) { return paper_method(kVoxel); }},
          {"cranemap", [](double) { return cranemap_method(kVoxel); }}};
}

/// What the mapper knows of time: nothing, interpolation, interpolation and the device's latency.
std::vector<Variant> timings(bool value_is_latency) {
  const auto nearest = [](double) {
    Method m = cranemap_method(kVoxel);
    m.nearest_position = true;
    return m;
  };
  std::vector<Variant> out = {{"nearest reading", nearest},
                              {"interpolated", [](double) { return cranemap_method(kVoxel); }}};
  if (value_is_latency)
    out.push_back({"and latency set", [](double delay_ms) {
                     Method m = cranemap_method(kVoxel);
                     m.mapper.cart_latency_ms = m.mapper.trolley_latency_ms =
                         static_cast<int>(delay_ms);
                     return m;
                   }});
  return out;
}

/// A lap past all obstacles in 24 frames, whatever the speed.
void travel(Scene& scene, double speed_mps) {
  constexpr double kLap = 6.8, kFrames = 24;
  scene.motion.continuous = true;
  scene.motion.points = {{0.3, 0.3}, {2.4, 0.3}, {2.4, 1.6}, {0.3, 1.6}};
  scene.motion.speed_mps = speed_mps;
  scene.motion.duration_s = kLap / speed_mps;
  scene.motion.rate_hz = kFrames / scene.motion.duration_s;
}

/// The lamps stay above the camera and as bright on the floor.
void raise(Scene& scene, double height_m) {
  scene.camera.samples = 4;  // a grain of the texture becomes smaller than a pixel
  scene.camera.rig.T_map_camera_at_zero.translation().z() = height_m;
  for (Lamp& lamp : scene.lamps) {
    const double z = std::max(lamp.centre.z(), height_m + 1.2);
    lamp.power *= z * z / (lamp.centre.z() * lamp.centre.z());
    lamp.centre.z() = z;
  }
}

std::vector<Sweep> all_sweeps() {
  const auto materials = [](auto change) {
    return [change](Scene& scene, double value) {
      for (auto& [name, material] : scene.materials) change(material, value);
    };
  };
  std::vector<Sweep> out;
  out.push_back({"Voxel size",
                 "voxel [m]",
                 {0.01, 0.02, 0.05, 0.10},
                 2,
                 nullptr,
                 {{"paper", [](double v) { return paper_method(v); }},
                  {"cranemap", [](double v) { return cranemap_method(v); }}}});
  out.push_back({"Rangefinder noise",
                 "standard deviation [mm]",
                 {0, 1, 3, 10, 30},
                 0,
                 [](Scene& s, double mm) { s.rangefinder.sigma_m = mm * 1e-3; },
                 both()});
  out.push_back({"Sensor noise",
                 "grey levels",
                 {0.5, 1.5, 3, 6, 12},
                 1,
                 [](Scene& s, double grey) { s.camera.noise_grey = grey; },
                 both()});
  out.push_back({"Gloss",
                 "strength of highlights on all materials",
                 {0, 0.3, 0.6, 0.9},
                 1,
                 materials([](Material& m, double gloss) {
                   m.gloss = gloss;
                   m.shininess = 120;
                 }),
                 both()});
  out.push_back({"Texture",
                 "contrast, of the rig's own",
                 {0.02, 0.05, 0.1, 0.3, 1},
                 2,
                 materials([](Material& m, double share) { m.texture *= share; }),
                 both()});
  out.push_back({"Light",
                 "exposure",
                 {0.05, 0.2, 1, 2, 4},
                 2,
                 [](Scene& s, double exposure) { s.camera.exposure = exposure; },
                 both()});
  out.push_back({"Height of the camera, voxel 1 % of it",
                 "above the floor [m]",
                 {1.5, 1.95, 3, 5, 8},
                 2,
                 raise,
                 {{"paper", [](double m) { return paper_method(0.01 * m); }},
                  {"cranemap", [](double m) { return cranemap_method(0.01 * m); }}}});
  out.push_back({"Baseline",
                 "[m]",
                 {0.06, 0.12, 0.24, 0.40},
                 2,
                 [](Scene& s, double m) {
                   auto& t = s.camera.rig.T_left_right;
                   t.translation() *= m / t.translation().norm();
                 },
                 both()});
  out.push_back({"Tilt of the mount",
                 "about the bridge [degrees]",
                 {0, 1, 3, 5},
                 0,
                 [](Scene& s, double degrees) {
                   s.camera.rig.T_map_camera_at_zero.rotate(Eigen::AngleAxisd(
                       degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitY()));
                 },
                 both()});
  out.push_back({"Speed of travel",
                 "[m/s], rangefinders at 20 Hz",
                 {0.1, 0.3, 0.6, 1.0},
                 1,
                 travel,
                 timings(false),
                 true});
  out.push_back({"Rangefinder delay",
                 "[ms] at 0.5 m/s",
                 {0, 20, 50, 100, 200},
                 0,
                 [](Scene& s, double ms) {
                   travel(s, 0.5);
                   s.rangefinder.delay_ms = ms;
                 },
                 timings(true),
                 true});
  return out;
}

Result<void> run(Bench& bench, const Sweep& sweep) {
  Plot plot{sweep.title,
            sweep.axis,
            sweep.moving ? "largest offset of an obstacle [mm]" : "worst height error [%]",
            {},
            {},
            sweep.moving ? 0.0 : 2.0};
  for (const Variant& v : sweep.variants) plot.lines.push_back({v.name, {}});
  std::vector<Row> rows;
  std::vector<std::string> notes;
  const std::string folder = bench.document.folder() + "/recording";
  std::optional<Recording> recording;
  Scene scene;
  for (const double value : sweep.values) {
    const std::string label = fixed(value, sweep.digits);
    bench.step(sweep.title + " " + label);
    if (!recording || sweep.change) {
      auto base = shipped_scene("rig");
      if (!base) return base.error();
      scene = std::move(*base);
      scene.camera.samples = 1;
      if (sweep.change) sweep.change(scene, value);
      std::filesystem::remove_all(folder);
      auto rendered = render(scene, folder);
      if (!rendered) return rendered.error();
      recording = std::move(*rendered);
    }
    plot.labels.push_back(label);
    for (std::size_t i = 0; i < sweep.variants.size(); ++i) {
      auto outcome = run_trial(*recording, scene, sweep.variants[i].method(value));
      if (!outcome) {  // PCL refuses a cloud with strays too far away: that is a result, too
        plot.lines[i].values.push_back(0);
        rows.push_back(
            {label + ", " + sweep.variants[i].name, "no map", "", "", "", "", "", "", ""});
        notes.push_back(label + ", " + sweep.variants[i].name + ": " + outcome.error().text());
        continue;
      }
      const Judgement& j = outcome->judgement;
      plot.lines[i].values.push_back(sweep.moving ? 1000 * outcome->offset_m
                                                  : outcome->worst_percent());
      rows.push_back({label + ", " + sweep.variants[i].name, fixed(outcome->worst_percent(), 2),
                      fixed(outcome->mean_percent(), 2), fixed(100 * j.coverage, 1),
                      fixed(100 * j.unsafe, 3), fixed(100 * j.missed, 3), fixed(100 * j.phantom, 3),
                      fixed(100 * outcome->cells.all.share(outcome->cells.all.cleared), 3),
                      fixed(1000 * outcome->offset_m, 1)});
    }
  }
  std::filesystem::remove_all(folder);
  bench.document.section(sweep.title);
  bench.document.plot(plot);
  bench.document.table({sweep.axis, "worst height [%]", "mean height [%]", "coverage [%]",
                        "unsafe [%]", "missed [%]", "phantom [%]", "cleared [%]", "offset [mm]"},
                       rows);
  for (const std::string& note : notes) bench.document.text(note);
  return {};
}

}  // namespace

std::size_t sweep_steps() {
  std::size_t steps = 0;
  for (const Sweep& sweep : all_sweeps()) steps += sweep.values.size();
  return steps;
}

Result<void> sweeps(Bench& bench) {
  for (const Sweep& sweep : all_sweeps())
    if (auto done = run(bench, sweep); !done) return done;
  return {};
}

}  // namespace crane::accuracy
