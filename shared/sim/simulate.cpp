#include "sim/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <thread>

#include "recording/recording_writer.hpp"
#include "sim/renderer.hpp"

namespace crane {
namespace {

constexpr TimeNs kStart = 1'700'000'000'000'000'000;

/// Cart and trolley at a time since the start.
class Path {
 public:
  explicit Path(const SceneMotion& motion) : motion_(motion) {
    for (std::size_t i = 0; i < motion.points.size(); ++i) round_m_ += leg(i);
  }
  [[nodiscard]] Eigen::Vector2d at(double seconds) const {
    if (!motion_.continuous) {
      const auto i =
          static_cast<std::size_t>(std::max(0.0, std::round(seconds / motion_.interval_s)));
      return motion_.points[std::min(i, motion_.points.size() - 1)];
    }
    double left = std::fmod(std::max(0.0, seconds) * motion_.speed_mps, round_m_);
    for (std::size_t i = 0; i < motion_.points.size(); ++i) {
      const double length = leg(i);
      if (left <= length) {
        const Eigen::Vector2d& a = motion_.points[i];
        return a + (next(i) - a) * (length > 0 ? left / length : 0);
      }
      left -= length;
    }
    return motion_.points.front();
  }

 private:
  [[nodiscard]] const Eigen::Vector2d& next(std::size_t i) const {
    return motion_.points[(i + 1) % motion_.points.size()];
  }
  [[nodiscard]] double leg(std::size_t i) const { return (next(i) - motion_.points[i]).norm(); }
  const SceneMotion& motion_;
  double round_m_ = 0;
};

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
                         const std::vector<Eigen::Vector2d>& seen_from, double cell) {
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
  for (const SceneObstacle& o : scene.obstacles) obstacles.push_back(o.shape);
  return write_obstacles(folder + "/truth/obstacles.yaml", obstacles);
}

}  // namespace

Result<void> simulate(const Scene& scene, const SimulateOptions& options) {
  const Renderer renderer(scene);
  const Path path(scene.motion);
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
    const Eigen::Vector2d at = path.at(stamp - delay);
    for (const bool cart : {true, false}) {
      const double m = (cart ? at.x() : at.y()) + noise(random);
      auto r = cart ? writer->add_cart(to_time(stamp), m) : writer->add_trolley(to_time(stamp), m);
      if (!r) return r;
    }
  }
  std::vector<Eigen::Vector2d> seen_from;
  for (std::size_t n = 0; n < frames; ++n) {
    const double seconds = double(n) * interval;
    const Eigen::Vector2d at = path.at(seconds);
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
  return write_truth(options.folder, scene, renderer, seen_from, options.truth_cell_m);
}

}  // namespace crane
