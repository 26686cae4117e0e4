// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/yaml_reader.hpp"
#include "sim/scene.hpp"

namespace crane {

// The parts of a scene file, each read from its own map. Problems are the reader's.

/// `folder` is what the path of a photograph counts from.
Material read_material(YamlReader& y, const std::string& folder);
SceneObstacle read_obstacle(YamlReader& y);
/// Nothing where no move is given.
std::optional<SceneHoist> read_hoist(YamlReader y);
ScenePit read_pit(YamlReader& y);
void read_untold(YamlReader y, UntoldMotion& m);
SceneBound read_bound(YamlReader y);

}  // namespace crane
