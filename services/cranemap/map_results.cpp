// SPDX-License-Identifier: Apache-2.0
#include "map_results.hpp"

#include <filesystem>

#include "base/clock.hpp"
#include "base/read_file.hpp"
#include "bounds.h"
#include "height_picture.hpp"
#include "map_codec/octomap_file.hpp"
#include "service/run_service.hpp"

namespace crane {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

Result<void> settle_map(const client::Map& map, Supervisor& services, Wakeup& wakeup) {
  constexpr double kQuietMs = 500;
  std::uint64_t revision = 0;
  Stopwatch since_change;
  for (const Stopwatch watch; watch.ms() < 300'000 && !stop_requested();) {
    const client::Status s = map.status();
    if (s.revision != revision) since_change = {};
    revision = s.revision;
    const bool making = !s.alive || s.reason_code == v1::MAP_BEING_MADE;
    if (!making && since_change.ms() > kQuietMs && watch.ms() > (s.complete ? 1000 : 20'000)) break;
    if (auto alive = services.watch(); !alive) return alive;
    wakeup.wait_for(50ms);
  }
  return {};
}

Result<void> write_map_results(const MapResults& r, RunReport& report) {
  const fs::path out = r.out;
  const fs::path truth = r.truth;
  const auto has_obstacles = is_there(truth / "obstacles.yaml");
  if (!has_obstacles) return has_obstacles.error();
  if (*has_obstacles) {
    auto obstacles = read_obstacles(truth / "obstacles.yaml");
    if (!obstacles) return obstacles.error();
    report.heights = measure(r.grid, *obstacles);
  }
  const auto has_truth = is_there(truth / "height_map.png");
  if (!has_truth) return has_truth.error();
  if (*has_truth) {
    auto solids = read_truth(truth);
    if (!solids) return solids.error();
    auto octree = read_octomap(out / "map.bt");
    if (!octree) return octree.error();
    auto judged = JudgedMap::from_file(*octree, solids->heights);
    if (!judged) return judged.error();
    report.judgement = evaluate(*judged, *solids);
    report.judged = true;
  }
  if (!r.grid.cells.empty() && report.voxels.occupied > 0) {
    if (auto w = write_height_map(out / "height_map.png", to_height_map(r.grid)); !w) return w;
    char title[160];
    std::snprintf(title, sizeof title, "cranemap %.60s: %llu frames, voxel %.3f m, method %s",
                  r.title.c_str(), static_cast<unsigned long long>(report.map.frames_integrated),
                  report.map.voxel_m, report.method.c_str());
    if (auto w = draw_heights(out / "height_map_view.png", r.grid, report.heights, r.zones, title);
        !w)
      return w;
  }
  for (const char* name : {"map.bt", "map.ot", "map.pcd", "height_map.png", "height_map_view.png"})
    if (std::error_code none; fs::exists(out / name, none))
      report.files[name] = fs::file_size(out / name, none);
  return write_json(out / "report.json", report);
}

}  // namespace crane
