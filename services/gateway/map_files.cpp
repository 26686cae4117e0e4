// SPDX-License-Identifier: Apache-2.0
#include "gateway/map_files.hpp"

#include "base/read_file.hpp"
#include "base/scratch_folder.hpp"
#include "cloud/pcl_filters.hpp"
#include "map_codec/octomap_points.hpp"

namespace crane::gateway {
Result<std::string> MapFiles::get(const std::string& kind) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock)
    return Error{ErrorCode::kNotAvailable, "map." + kind, "another one is being made",
                 "ask again in a few seconds"};
  const client::Status s = map_.status();
  if (const std::pair now{s.map_id, s.revision}; now != of_) {
    kept_.clear();
    of_ = now;
  }
  if (const auto kept = kept_.find(kind); kept != kept_.end()) return kept->second;
  auto made = make(kind);
  if (made) kept_[kind] = *made;
  return made;
}

Result<std::string> MapFiles::make(const std::string& kind) const {
  const ScratchFolder folder("cranemap-gateway-");
  if (folder.path().empty())
    return Error{ErrorCode::kResource, "map." + kind, "no room for it in the temporary folder",
                 "give TMPDIR a folder that can be written"};
  const std::string bt = folder.path() + "/map.bt";
  const std::string file = folder.path() + "/map." + kind;
  std::string why;
  if (!map_.save_bt(bt, why)) return Error{ErrorCode::kResource, "map.bt", why, ""};
  if (kind == "ot") {
    if (auto w = convert_bt_to_ot(bt, file); !w) return w.error();
  } else if (kind != "bt") {
    const auto map = read_octomap(bt);
    if (!map) return map.error();
    if (map->occupied.empty())
      return Error{ErrorCode::kNotAvailable, "the map", "has no surface yet", ""};
    const PointCloud points = occupied_points(*map);
    if (auto w = kind == "pcd" ? write_pcd(file, points) : write_ply(file, points); !w)
      return w.error();
  }
  return read_file(file, kMaxOctomapBytes);
}

}  // namespace crane::gateway
