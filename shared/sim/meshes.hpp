#pragma once

#include <array>
#include <vector>

#include "sim/scene.hpp"

namespace crane {

/// Triangles in the map frame.
struct Mesh {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

Mesh mesh_of(const SceneObstacle& obstacle);
/// A square of the floor z = 0.
Mesh floor_mesh(double half_size_m);

}  // namespace crane
