// SPDX-License-Identifier: Apache-2.0
#include "mapper/map_gauges.hpp"

#include <array>
#include <string>

#include "bounds.h"

namespace crane {
namespace {

/// By v1::MAP_*.
constexpr std::array kReasons = {"none",
                                 "nothing_yet",
                                 "no_clouds",
                                 "being_made",
                                 "hoist_lost",
                                 "cart_position",
                                 "trolley_position",
                                 "contradicted",
                                 "other_calibration",
                                 "memory_full",
                                 "hoist_of_another_time"};
static_assert(kReasons.size() == v1::MAP_HOIST_OF_ANOTHER_TIME + 1);

}  // namespace

Gauge tiles_gauge(std::size_t tiles) {
  return {"map_tiles", "Tiles of the map in memory.", double(tiles), {}};
}

std::vector<Gauge> map_gauges(const MapFigures& map, const FrameAccount& account) {
  std::vector<Gauge> g = {
      {"map_valid", "1 while the map is valid, as map_status says it.", map.valid ? 1.0 : 0.0, {}}};
  for (std::size_t code = 0; code < kReasons.size(); ++code)
    g.push_back({"map_reason", "1 for the reason that holds: why the map is not valid, or none.",
                 code == map.reason_code ? 1.0 : 0.0,
                 "reason=\"" + std::string(kReasons[code]) + "\""});
  g.push_back(
      {"map_reason", "", map.reason_code < kReasons.size() ? 0.0 : 1.0, "reason=\"other\""});
  g.push_back({"map_revision", "Grows with every published change.", double(map.revision), {}});
  g.push_back(tiles_gauge(map.tiles));
  g.push_back({"map_memory_bytes", "What the map takes.", double(map.memory_bytes), {}});
  g.push_back({"map_frames_integrated",
               "Frames of this stream in the map.",
               double(account.integrated),
               {}});
  g.push_back({"map_frames_missing",
               "Frames of this stream that never arrived.",
               double(account.missing),
               {}});
  g.push_back({"map_last_exposure_time_seconds",
               "Exposure of the last frame, Unix epoch.",
               double(account.last_frame_time) * 1e-9,
               {}});
  return g;
}

}  // namespace crane
