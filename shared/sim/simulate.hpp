#pragma once

#include <functional>
#include <string>

#include "sim/scene.hpp"

namespace crane {

struct SimulateOptions {
  std::string folder;               ///< of the new recording
  std::string format = "jpg";       ///< images: jpg (quality 95) or png
  std::size_t max_frames = 0;       ///< 0 = all of the motion
  double truth_cell_m = 0.01;
  std::function<bool(std::size_t done, std::size_t total)> progress;  ///< false stops
};

/// Renders a scene into a recording with truth (true heights, obstacles; depths when standing
/// still). The same scene and seed give the same recording. Error: Resource.
Result<void> simulate(const Scene& scene, const SimulateOptions& options);

}  // namespace crane
