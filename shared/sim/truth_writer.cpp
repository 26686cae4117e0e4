// SPDX-License-Identifier: Apache-2.0
#include "sim/truth_writer.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <thread>

namespace crane {

Result<void> write_grey16(const std::string& path, std::uint32_t width, std::uint32_t height,
                          std::vector<std::uint16_t> values) {
  // Same format as the height map, without its geometry.
  HeightMap image;
  image.columns = width;
  image.rows = height;
  image.height_mm = std::move(values);
  auto written = write_height_map(path, image);
  std::error_code ignored;
  std::filesystem::remove(std::filesystem::path(path).replace_extension(".yaml"), ignored);
  return written;
}

Result<void> write_depth(const std::string& folder, TimeNs time, const Renderer& renderer,
                         const StereoRig& rig, const Eigen::Vector2d& at, double seconds) {
  std::vector<std::uint16_t> mm;
  for (float m : renderer.depth(at.x(), at.y(), seconds))
    mm.push_back(static_cast<std::uint16_t>(std::clamp(m * 1000 + 0.5F, 0.0F, 65'535.0F)));
  return write_grey16(folder + "/truth/depth0/" + std::to_string(time) + ".png", rig.left.width,
                      rig.left.height, std::move(mm));
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
  for (const ScenePit& pit : scene.pits)
    map.offset_m = std::min(map.offset_m, -std::ceil(pit.depth_m));
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
          map.height_mm[std::size_t(row) * map.columns + column] = static_cast<std::uint16_t>(
              std::lround(std::clamp((z - map.offset_m) * 1000, 0.0, 65'534.0)));
      }
  };
  {
    const std::jthread odd(work, 1U);
    work(0);
  }
  if (auto r = write_height_map(folder + "/truth/height_map.png", map); !r) return r;
  std::vector<TrueObstacle> obstacles;
  const auto standing = obstacles_at(scene, end_s);
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i)
    if (standing[i]) obstacles.push_back(standing[i]->shape);
  return write_obstacles(folder + "/truth/obstacles.yaml", obstacles);
}

}  // namespace crane
