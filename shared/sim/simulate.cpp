// SPDX-License-Identifier: Apache-2.0
#include "sim/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "config/site_config.hpp"
#include "recording/recording_writer.hpp"
#include "sim/truth_writer.hpp"

namespace crane {
namespace {

constexpr TimeNs kStart = 1'700'000'000'000'000'000;

TimeNs to_time(double seconds) {
  return kStart + std::llround(seconds * 1e9);
}

/// hoist_state as the controller would say it.
Result<void> write_hoist(const Scene& scene, double end_s, RecordingWriter& writer) {
  const double step = 1 / scene.hoist->rate_hz;
  for (double t = -0.3; t < end_s + 0.6; t += step) {
    HoistReading r = hoist_reading_at(scene, t);
    r.time = to_time(t);
    if (auto added = writer.add_hoist(r); !added) return added;
  }
  return {};
}

/// What the mapper must know of hoist and rails: site.yaml, which `cranemap run` takes by itself.
Result<void> write_site(const Scene& scene, const std::string& folder) {
  SiteConfig site;
  site.mapper.rail_y_m = scene.rangefinder.rail_y_m;
  site.mapper.rail_span_m = scene.rangefinder.rail_span_m;
  if (scene.hoist) set_hoist(scene, site);
  std::ofstream file(folder + "/site.yaml");
  file << to_yaml(site);
  file.close();
  if (file) return {};
  return Error{ErrorCode::kResource, folder + "/site.yaml", "cannot be written",
               "check permissions and free space"};
}

struct Readings {
  std::vector<RecordedDistance> cart, cart_second, trolley;
};

/// What the rangefinders say: where the axes were `delay` before the time stamp, with noise.
Readings measure(const Scene& scene, double end_s) {
  std::mt19937_64 random(scene.seed);
  std::normal_distribution<double> noise(0, std::max(scene.rangefinder.sigma_m, 1e-12));
  const double step = 1 / scene.rangefinder.rate_hz;
  const double delay = scene.rangefinder.delay_ms * 1e-3;
  const auto count = static_cast<std::int64_t>((end_s + 0.6) / step);
  Readings out;
  for (std::int64_t i = 0; i <= count; ++i) {
    const double stamp = -0.3 + double(i) * step;
    const Eigen::Vector2d at = gantry_at(scene.motion, stamp - delay);
    const SceneRangefinder& r = scene.rangefinder;
    if (r.rail_span_m == 0) {
      out.cart.push_back({to_time(stamp), at.x() + noise(random)});
    } else {
      // The bridge is a straight line, turned about the trolley.
      const Eigen::Matrix3d turned =
          untold_at(scene.untold, at, std::max(0.0, stamp - delay)).linear();
      const double per_m = -turned(1, 0) / turned(0, 0);
      const double first = at.x() + per_m * (r.rail_y_m - at.y());
      out.cart.push_back({to_time(stamp), first + noise(random)});
      out.cart_second.push_back({to_time(stamp), first + per_m * r.rail_span_m + noise(random)});
    }
    out.trolley.push_back({to_time(stamp), at.y() + noise(random)});
  }
  return out;
}

/// One pair of images.
Result<void> add_frame(const Scene& scene, const SimulateOptions& options, const Renderer& renderer,
                       const Eigen::Vector2d& at, std::size_t n, double seconds,
                       RecordingWriter& writer) {
  const TimeNs time = to_time(seconds);
  const Image left = renderer.render(true, at.x(), at.y(), n, seconds);
  const Image right = renderer.render(false, at.x(), at.y(), n, seconds);
  const bool deep = scene.camera.bits > 8;
  if (auto r = writer.add_frame(time, left, right, deep ? "png" : options.format); !r) return r;
  if (!deep) return {};
  // Over the images of 8 bits, under the same names.
  for (const bool is_left : {true, false}) {
    const CameraModel& c = is_left ? scene.camera.rig.left : scene.camera.rig.right;
    const std::string path =
        options.folder + (is_left ? "/cam0/data/" : "/cam1/data/") + std::to_string(time) + ".png";
    if (auto r = write_grey16(path, c.width, c.height,
                              renderer.render_deep(is_left, at.x(), at.y(), n, seconds));
        !r)
      return r;
  }
  return {};
}

/// Whether what stands there is not always the same.
bool changes(const Scene& scene) {
  return scene.hoist ||
         std::any_of(scene.obstacles.begin(), scene.obstacles.end(), [](const SceneObstacle& o) {
           return o.from_s > 0 || std::isfinite(o.until_s) || !o.track.empty();
         });
}

}  // namespace

HoistReading hoist_reading_at(const Scene& scene, double seconds) {
  const SceneHoist& h = *scene.hoist;
  const HoistPose pose = hoist_at(h, within_round(scene.motion, seconds));
  HoistReading r;
  r.hook_height_m = pose.hook_m;
  r.sling_m = h.sling_m;
  if (pose.load) r.load_size_m = h.load_size_m;
  r.load_yaw_rad = h.load_yaw_rad;
  r.sway_m = pose.sway_m;
  return r;
}

void set_hoist(const Scene& scene, SiteConfig& site) {
  const SceneHoist& h = *scene.hoist;
  site.hoist.enabled = true;
  site.hoist.offset_x_m = h.offset_m.x();
  site.hoist.offset_y_m = h.offset_m.y();
  site.hoist.rope_top_m = h.rope_top_m;
  site.hoist.rope_radius_m = h.rope_radius_m;
  site.hoist.hook_x_m = h.hook_size_m.x();
  site.hoist.hook_y_m = h.hook_size_m.y();
  site.hoist.hook_z_m = h.hook_size_m.z();
  site.hoist.largest_load_m = std::max(0.1, h.load_size_m.head<2>().maxCoeff());
  // Margins in proportion to the scene: a tenth of a metre on a rig of two metres.
  const double scale = scene.camera.rig.camera_height_m() / 10;
  site.hoist.margin_m = std::clamp(0.3 * scale, 0.04, 0.3);
  site.hoist.sway_m = std::clamp(0.2 * scale, 0.02, 0.3);
  site.hoist.accuracy_m = std::clamp(0.1 * scale, 0.01, 0.1);
}

Result<void> simulate(const Scene& scene, const SimulateOptions& options) {
  Renderer renderer(scene);
  const SceneMotion& motion = scene.motion;
  const double interval = motion.continuous ? 1 / motion.rate_hz : motion.interval_s;
  std::size_t frames =
      motion.continuous ? static_cast<std::size_t>(std::llround(motion.duration_s * motion.rate_hz))
                        : motion.points.size();
  if (options.max_frames > 0) frames = std::min(frames, options.max_frames);
  RangefinderModel model;
  model.accuracy_m = 3 * scene.rangefinder.sigma_m;
  model.rate_hz = scene.rangefinder.rate_hz;
  for (const Eigen::Vector2d& p : motion.points)
    model.range_m = std::max({model.range_m, std::abs(p.x()) + 1, std::abs(p.y()) + 1});
  std::vector<Fault> faults = scene.faults;
  faults.insert(faults.end(), options.faults.begin(), options.faults.end());
  StereoRig told = told_rig(scene.camera.rig, faults);
  if (scene.camera.bits > 8) told.left.bits = told.right.bits = scene.camera.bits;
  if (auto usable = check_rig(told, "the rig with its faults"); !usable) return usable;
  auto writer = RecordingWriter::create(options.folder, told, 1 / interval, model);
  if (!writer) return writer.error();
  std::error_code failed;
  std::filesystem::create_directories(options.folder + "/truth/depth0", failed);

  const double end = double(frames - 1) * interval;
  Readings readings = measure(scene, end);
  const std::size_t middle_frame = frames / 2;
  const TimeNs middle = to_time(double(middle_frame) * interval);
  spoil(readings.cart, faults, true, middle);
  spoil(readings.trolley, faults, false, middle);
  for (const RecordedDistance& r : readings.cart)
    if (auto added = writer->add_cart(r.time, r.distance_m); !added) return added;
  for (const RecordedDistance& r : readings.cart_second)
    if (auto added = writer->add_cart_second(r.time, r.distance_m); !added) return added;
  for (const RecordedDistance& r : readings.trolley)
    if (auto added = writer->add_trolley(r.time, r.distance_m); !added) return added;
  if (scene.hoist)
    if (auto r = write_hoist(scene, end, *writer); !r) return r;
  std::vector<Eigen::Vector2d> seen_from;
  for (std::size_t n = 0; n < frames; ++n) {
    const double seconds = double(n) * interval;
    const Eigen::Vector2d at = gantry_at(motion, seconds);
    if (changes(scene)) renderer.show(obstacles_at(scene, seconds));
    if (auto r = add_frame(scene, options, renderer, at, n, seconds, *writer); !r) return r;
    if (!motion.continuous) {
      if (auto r = write_depth(options.folder, to_time(seconds), renderer, scene.camera.rig, at,
                               seconds);
          !r)
        return r;
    }
    if (!motion.continuous || n % 10 == 0) seen_from.push_back(at);
    if (options.progress && !options.progress(n + 1, frames))
      return Error{ErrorCode::kNotAvailable, options.folder, "stopped before the end", ""};
  }
  if (auto r = writer->close(); !r) return r;
  if (scene.hoist || scene.rangefinder.rail_span_m != 0)
    if (auto r = write_site(scene, options.folder); !r) return r;
  // The truth is what stands there at the end; what hangs is no part of it.
  auto left_over = obstacles_at(scene, end);
  left_over.resize(scene.obstacles.size());
  renderer.show(left_over);
  return write_truth(options.folder, scene, renderer, seen_from, end, options.truth_cell_m);
}

}  // namespace crane
