// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "mapping_pipeline/mapping_pipeline.hpp"
#include "service/metrics.hpp"

namespace crane {

/// What the mapper tells of its map on /metrics.
struct MapFigures {
  std::uint64_t revision = 0;
  std::size_t tiles = 0, memory_bytes = 0;
  bool valid = false;
  std::uint32_t reason_code = 0;  ///< v1::MAP_*, as map_status has it
};
std::vector<Gauge> map_gauges(const MapFigures& map, const FrameAccount& account);

Gauge tiles_gauge(std::size_t tiles);

}  // namespace crane
