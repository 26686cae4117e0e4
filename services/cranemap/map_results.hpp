// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/wakeup.hpp"
#include "crane/client/map.hpp"
#include "run_report.hpp"
#include "supervisor.hpp"

namespace crane {

/// Waits until the map that is published is the last one. The paper's method makes it after the
/// last cloud; it says so while it does. Error: of a service that ended.
Result<void> settle_map(const client::Map& map, Supervisor& services, Wakeup& wakeup);

/// What the map is judged by and drawn from at the end of a run.
struct MapResults {
  std::string out;    ///< has map.bt; gets height_map.png, height_map_view.png, report.json
  std::string truth;  ///< folder; what is there of height_map.png and obstacles.yaml is used
  std::string title;  ///< of the picture: what was mapped
  client::HeightGrid grid;
  std::vector<client::Zone> zones;
};

/// Judges, draws, and writes the report, whose heights, judgement and files it fills in.
/// Error: BadData or Configuration of the truth, Resource.
Result<void> write_map_results(const MapResults& results, RunReport& report);

}  // namespace crane
