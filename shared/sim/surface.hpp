// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/scene.hpp"

namespace crane {

/// Colour of a surface point before any light: the material's own, its photograph or pattern, its
/// texture. `p_texture` is the map point less what its solid has moved.
Eigen::Vector3f albedo_at(const Material& material, const Eigen::Vector3f& p_texture,
                          const Eigen::Vector3f& normal, std::uint64_t seed);

}  // namespace crane
