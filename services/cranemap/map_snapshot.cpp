// SPDX-License-Identifier: Apache-2.0
#include "map_snapshot.hpp"

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <fstream>

#include "cloud/pcl_filters.hpp"
#include "config/yaml_text.hpp"
#include "geometry/footprint.hpp"
#include "map_codec/octomap_points.hpp"
#include "obstacle_heights.hpp"
#include "recording/time_check.hpp"
#include "recording/truth.hpp"

namespace crane {
namespace {

std::string duration_text(double seconds) {
  char text[32];
  if (seconds < 120)
    std::snprintf(text, sizeof text, "%.0f s", seconds);
  else if (seconds < 7200)
    std::snprintf(text, sizeof text, "%.0f min", seconds / 60);
  else
    std::snprintf(text, sizeof text, "%.1f h", seconds / 3600);
  return text;
}

/// Occupied voxels, coloured by height as the picture is.
PointCloud points_of(const OctomapFile& map) {
  double low = 0, high = 0.1;
  for (const MapCube& c : map.occupied) {
    low = std::min(low, c.z_m);
    high = std::max(high, c.z_m);
  }
  PointCloud out = occupied_points(map);
  for (Point& p : out) {
    const auto colour = height_colour((double(p.z) - low) / (high - low));
    p.r = colour[0], p.g = colour[1], p.b = colour[2];
  }
  return out;
}

LiveOverlay overlay_of(const MapSnapshot& s) {
  LiveOverlay live;
  live.now = s.taken;
  live.crane = s.position;
  if (s.position && s.rig)
    for (const Eigen::Vector2d& p : footprint(*s.rig, {s.position->x_m, s.position->y_m}))
      live.footprint.push_back({p.x(), p.y()});
  if (!s.status.complete)
    live.warning = "NOT COMPLETE: parts of the map had not arrived";
  else if (!s.status.valid)
    live.warning = "NOT VALID: " + s.status.reason.substr(0, 90);
  const SurfaceAges ages = ages_of(s.grid, s.taken);
  char line[200];
  std::snprintf(line, sizeof line,
                "crane %d    %s UTC    revision %" PRIu64 "    %" PRIu64 " frames in the map",
                s.crane, utc_text(s.taken).c_str(), s.status.revision, s.status.frames_integrated);
  live.foot.emplace_back(line);
  std::snprintf(
      line, sizeof line,
      "surfaces last seen: newest %s ago, half within %s, oldest %s ago; %.1f %% too long "
      "ago to be known",
      duration_text(ages.newest_s).c_str(), duration_text(ages.median_s).c_str(),
      duration_text(ages.oldest_s).c_str(),
      ages.known > 0 ? 100.0 * double(ages.stale) / double(ages.known + ages.stale) : 0);
  live.foot.emplace_back(line);
  live.foot.emplace_back(!s.position ? "where the crane is was not told"
                         : !live.footprint.empty()
                             ? "cross: camera's place by cart and trolley; frame: what it sees "
                               "of the floor"
                             : "cross: camera's place by cart and trolley");
  return live;
}

Result<void> write_facts(const MapSnapshot& s, const std::string& path) {
  const SurfaceAges ages = ages_of(s.grid, s.taken);
  std::ofstream file(path);
  file << "# written by cranemap snapshot\ntaken_ns: " << s.taken << "\ntaken_utc: \""
       << utc_text(s.taken) << "\"\ncrane: " << s.crane
       << "\nvalid: " << (s.status.valid ? "true" : "false")
       << "\ncomplete: " << (s.status.complete ? "true" : "false")
       << "\nreason: " << yaml_quoted(s.status.reason) << "\nreason_code: " << s.status.reason_code
       << "\nmap_id: " << s.status.map_id << "\nrevision: " << s.status.revision
       << "\nvoxel_m: " << s.status.voxel_m << "\nframes_integrated: " << s.status.frames_integrated
       << "\nlast_frame_time_ns: " << s.status.last_frame_time_ns << "\ntiles: " << s.status.tiles
       << "\ntiles_left_out: " << s.grid.tiles_left_out;
  if (s.position)
    file << "\ncart_m: " << yaml_exact(s.position->x_m)
         << "\ntrolley_m: " << yaml_exact(s.position->y_m);
  file << "\nages_s: {newest: " << ages.newest_s << ", median: " << ages.median_s
       << ", oldest: " << ages.oldest_s << "}\ncolumns: {known: " << ages.known
       << ", stale: " << ages.stale << "}\n";
  file.close();
  if (file) return {};
  return Error{ErrorCode::kResource, path, "cannot be written", "check permissions and free space"};
}

}  // namespace

SurfaceAges ages_of(const client::HeightGrid& grid, TimeNs now) {
  SurfaceAges out;
  std::vector<double> ages;
  for (const client::Height& c : grid.cells) {
    if (c.surface == client::Surface::kStale) ++out.stale;
    if (client::is_known(c.surface))
      ages.push_back(std::max(0.0, double(now - c.last_observed_ns) * 1e-9));
  }
  out.known = ages.size();
  if (ages.empty()) return out;
  std::sort(ages.begin(), ages.end());
  out.newest_s = ages.front();
  out.median_s = ages[ages.size() / 2];
  out.oldest_s = ages.back();
  return out;
}

Result<void> write_snapshot(const MapSnapshot& s, const std::string& folder) {
  const auto map = read_octomap(folder + "/map.bt");
  if (!map) return map.error();
  if (map->occupied.empty())
    return Error{ErrorCode::kNotAvailable, "the map", "has no surface yet",
                 "wait until the camera has seen something: 'cranemap watch'"};
  if (auto w = convert_bt_to_ot(folder + "/map.bt", folder + "/map.ot"); !w) return w;
  const PointCloud points = points_of(*map);
  if (auto w = write_pcd(folder + "/map.pcd", points); !w) return w;
  if (auto w = write_ply(folder + "/map.ply", points); !w) return w;
  if (auto w = write_height_map(folder + "/height_map.png", to_height_map(s.grid)); !w) return w;
  LiveOverlay live = overlay_of(s);
  if (auto w = draw_heights(folder + "/map_view.png", s.grid, {}, s.zones,
                            "Heights, crane " + std::to_string(s.crane), &live);
      !w)
    return w;
  live.ages = true;
  if (auto w = draw_heights(folder + "/map_ages.png", s.grid, {}, s.zones,
                            "How long ago each surface was seen, crane " + std::to_string(s.crane),
                            &live);
      !w)
    return w;
  return write_facts(s, folder + "/snapshot.yaml");
}

}  // namespace crane
