// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sim/scene.hpp"

namespace crane {

/// A file, or the name of a scene that ships with cranemap: beside an installed program.
std::string scene_file(const std::string& name);

/// A scene as a crane drives through it: from point to point at constant speed and round again,
/// also where its recording would stand at each point; images at a rate.
struct LiveSceneOptions {
  double speed_mps = 0;     ///< 0 = the scene's
  double rate_hz = 0;       ///< 0 = the scene's
  bool without_end = true;  ///< else one round, or the scene's own time table
};
/// Error: Configuration: the file, or what of a scene cannot be had live.
Result<Scene> read_live_scene(const std::string& name, const LiveSceneOptions& options);

}  // namespace crane
