// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "trial.hpp"

namespace crane::accuracy {

/// One scene of shared/sim/scenes/workshop, mapped and judged.
struct WorkshopResult {
  std::string scene;
  Outcome outcome;
  TrueSolids truth;
  std::vector<ObstacleHeight> heights;  ///< of what stands there at the end
  std::vector<std::string> short_of;    ///< bounds that do not hold, in words
  std::size_t recorded = 0;             ///< frames
  double render_s = 0, map_s = 0;
};

struct WorkshopOptions {
  bool quick = false;  ///< the small version
  std::size_t queries = 20'000;
  double voxel_m = 0.05;
};

/// All scenes by name; quick: those that have a small version.
std::vector<std::filesystem::path> workshop_scenes(bool quick);

/// Renders into `folder`, which must be new, maps and judges.
Result<WorkshopResult> run_workshop_scene(const std::filesystem::path& scene,
                                          const std::string& folder,
                                          const WorkshopOptions& options);

/// Maps and judges a recording with truth that somebody else made, against what must hold of every
/// map: nothing cleared, hollow or wrongly clear; low at most 0.01, phantom at most 0.005.
Result<WorkshopResult> run_workshop_recording(const std::filesystem::path& recording,
                                              const WorkshopOptions& options);

/// Scenes that today's mapping is known to fall short in. A scene that is not listed must hold all
/// its bounds; one that is listed and holds them is to be taken off. Why, or nullptr.
const char* known_short(const std::string& scene);

}  // namespace crane::accuracy
