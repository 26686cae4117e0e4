// SPDX-License-Identifier: Apache-2.0
#include "live_scene.hpp"

#include <filesystem>

namespace crane {

namespace fs = std::filesystem;

std::string scene_file(const std::string& name) {
  std::error_code failed;
  const fs::path shipped = fs::read_symlink("/proc/self/exe", failed).parent_path().parent_path() /
                           "share/cranemap/scenes";
  if (fs::exists(name, failed)) return name;
  for (const fs::path& file : {shipped / (name + ".yaml"), shipped / "workshop" / (name + ".yaml")})
    if (fs::exists(file, failed)) return file;
  return name;
}

Result<Scene> read_live_scene(const std::string& name, const LiveSceneOptions& options) {
  const std::string file = scene_file(name);
  auto scene = read_scene(file);
  if (!scene) return scene;
  const auto refuse = [&](const char* what) {
    return Error{ErrorCode::kConfiguration, file, what,
                 "render it with 'cranemap simulate' and play the recording"};
  };
  if (scene->rangefinder.rail_span_m != 0)
    return refuse("has two rangefinders of the cart, which are not emulated live");
  if (scene->camera.bits > 8) return refuse("has a camera of more than 8 bits");
  SceneMotion& motion = scene->motion;
  if (options.speed_mps > 0) motion.speed_mps = options.speed_mps;
  if (options.rate_hz > 0)
    motion.rate_hz = options.rate_hz;
  else if (!motion.continuous)
    motion.rate_hz = 1 / motion.interval_s;
  motion.continuous = true;
  if (options.without_end && motion.repeat_s > 0) motion.duration_s = 1e9;
  if (motion.times_s.empty()) {
    double round_m = 0;
    for (std::size_t i = 0; i < motion.points.size(); ++i)
      round_m += (motion.points[(i + 1) % motion.points.size()] - motion.points[i]).norm();
    motion.duration_s = options.without_end ? 1e9 : round_m / motion.speed_mps;
  }
  return scene;
}

}  // namespace crane
