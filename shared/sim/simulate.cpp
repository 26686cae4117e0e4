#include "sim/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "config/site_config.hpp"
#include "recording/recording_writer.hpp"
#include "sim/renderer.hpp"

namespace crane {
namespace {

constexpr TimeNs kStart = 1'700'000'000'000'000'000;

TimeNs to_time(double seconds) {
  return kStart + std::llround(seconds * 1e9);
}

Result<void> write_depth(const std::string& folder, TimeNs time, const Renderer& renderer,
                         const StereoRig& rig, const Eigen::Vector2d& at) {
  // Same format as the height map, without its geometry: 16-bit millimetres.
  HeightMap image;
  image.columns = rig.left.width;
  image.rows = rig.left.height;
  for (float m : renderer.depth(at.x(), at.y()))
    image.height_mm.push_back(
        static_cast<std::uint16_t>(std::clamp(m * 1000 + 0.5F, 0.0F, 65'535.0F)));
  const std::string path = folder + "/truth/depth0/" + std::to_string(time) + ".png";
  auto written = write_height_map(path, image);
  std::error_code ignored;
  std::filesystem::remove(std::filesystem::path(path).replace_extension(".yaml"), ignored);
  return written;
}

Result<void> write_truth(const std::string& folder, const Scene& scene, const Renderer& renderer,
                         const std::vector<Eigen::Vector2d>& seen_from, double end_s, double cell) {
  const CameraModel& c = scene.camera.rig.left;
  const double height = scene.camera.rig.camera_height_m();
  const double reach = height * std::hypot(c.width / c.fx_px, c.height / c.fy_px) / 2 * 1.2;
  HeightMap map;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : seen_from) box.extend(p);
  map.cell_m = cell;
  map.origin_x_m = std::floor((box.min().x() - reach) / cell) * cell;
  map.origin_y_m = std::floor((box.min().y() - reach) / cell) * cell;
  map.columns =
      static_cast<std::uint32_t>(std::ceil((box.max().x() + reach - map.origin_x_m) / cell));
  map.rows = static_cast<std::uint32_t>(std::ceil((box.max().y() + reach - map.origin_y_m) / cell));
  map.height_mm.assign(std::size_t(map.columns) * map.rows, HeightMap::kNeverSeen);
  const auto work = [&](std::uint32_t first) {
    for (std::uint32_t row = first; row < map.rows; row += 2)
      for (std::uint32_t column = 0; column < map.columns; ++column) {
        const double x = map.origin_x_m + (column + 0.5) * cell;
        const double y = map.origin_y_m + (row + 0.5) * cell;
        const double z = renderer.height_m(x, y);
        const bool seen = std::any_of(seen_from.begin(), seen_from.end(), [&](const auto& from) {
          return renderer.sees(from.x(), from.y(), {x, y, z});
        });
        if (seen)
          map.height_mm[std::size_t(row) * map.columns + column] =
              static_cast<std::uint16_t>(std::lround(std::clamp(z * 1000, 0.0, 65'534.0)));
      }
  };
  {
    const std::jthread odd(work, 1U);
    work(0);
  }
  if (auto r = write_height_map(folder + "/truth/height_map.png", map); !r) return r;
  std::vector<TrueObstacle> obstacles;
  for (const SceneObstacle& o : scene.obstacles)
    if (o.from_s <= end_s && end_s < o.until_s) obstacles.push_back(o.shape);
  return write_obstacles(folder + "/truth/obstacles.yaml", obstacles);
}

/// hoist_state as the controller would say it.
Result<void> write_hoist(const SceneHoist& h, double end_s, RecordingWriter& writer) {
  const double step = 1 / h.rate_hz;
  for (double t = -0.3; t < end_s + 0.6; t += step) {
    const HoistPose pose = hoist_at(h, std::max(t, 0.0));
    HoistReading r;
    r.time = to_time(t);
    r.hook_height_m = pose.hook_m;
    r.sling_m = h.sling_m;
    if (pose.load) r.load_size_m = h.load_size_m;
    r.load_yaw_rad = h.load_yaw_rad;
    r.sway_m = pose.sway_m;
    if (auto added = writer.add_hoist(r); !added) return added;
  }
  return {};
}

/// What the mapper must know of the hoist: site.yaml, which `cranemap run` takes by itself.
Result<void> write_site(const Scene& scene, const std::string& folder) {
  const SceneHoist& h = *scene.hoist;
  SiteConfig site;
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
  std::ofstream file(folder + "/site.yaml");
  file << to_yaml(site);
  file.close();
  if (file) return {};
  return Error{ErrorCode::kResource, folder + "/site.yaml", "cannot be written",
               "check permissions and free space"};
}

}  // namespace

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
  auto writer = RecordingWriter::create(options.folder, scene.camera.rig, 1 / interval, model);
  if (!writer) return writer.error();
  std::error_code failed;
  std::filesystem::create_directories(options.folder + "/truth/depth0", failed);

  // A reading says where the axis was `delay` before its time stamp.
  std::mt19937_64 random(scene.seed);
  std::normal_distribution<double> noise(0, std::max(scene.rangefinder.sigma_m, 1e-12));
  const double step = 1 / scene.rangefinder.rate_hz;
  const double delay = scene.rangefinder.delay_ms * 1e-3;
  const double end = double(frames - 1) * interval;
  const auto readings = static_cast<std::int64_t>((end + 0.6) / step);
  for (std::int64_t i = 0; i <= readings; ++i) {
    const double stamp = -0.3 + double(i) * step;
    const Eigen::Vector2d at = gantry_at(motion, stamp - delay);
    for (const bool cart : {true, false}) {
      const double m = (cart ? at.x() : at.y()) + noise(random);
      auto r = cart ? writer->add_cart(to_time(stamp), m) : writer->add_trolley(to_time(stamp), m);
      if (!r) return r;
    }
  }
  if (scene.hoist)
    if (auto r = write_hoist(*scene.hoist, end, *writer); !r) return r;
  const bool changes = scene.hoist || std::any_of(scene.obstacles.begin(), scene.obstacles.end(),
                                                  [](const SceneObstacle& o) {
                                                    return o.from_s > 0 || std::isfinite(o.until_s);
                                                  });
  std::vector<Eigen::Vector2d> seen_from;
  for (std::size_t n = 0; n < frames; ++n) {
    const double seconds = double(n) * interval;
    const Eigen::Vector2d at = gantry_at(motion, seconds);
    if (changes) renderer.show(obstacles_at(scene, seconds));
    const Image left = renderer.render(true, at.x(), at.y(), n);
    const Image right = renderer.render(false, at.x(), at.y(), n);
    if (auto r = writer->add_frame(to_time(seconds), left, right, options.format); !r) return r;
    if (!motion.continuous) {
      if (auto r = write_depth(options.folder, to_time(seconds), renderer, scene.camera.rig, at);
          !r)
        return r;
    }
    if (!motion.continuous || n % 10 == 0) seen_from.push_back(at);
    if (options.progress && !options.progress(n + 1, frames))
      return Error{ErrorCode::kNotAvailable, options.folder, "stopped before the end", ""};
  }
  if (auto r = writer->close(); !r) return r;
  if (scene.hoist)
    if (auto r = write_site(scene, options.folder); !r) return r;
  // The truth is what stands there at the end; what hangs is no part of it.
  auto left_over = obstacles_at(scene, end);
  left_over.resize(scene.obstacles.size());
  renderer.show(left_over);
  return write_truth(options.folder, scene, renderer, seen_from, end, options.truth_cell_m);
}

}  // namespace crane
