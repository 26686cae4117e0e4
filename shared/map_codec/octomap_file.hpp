#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "mapping/map_judge.hpp"

namespace crane {

/// What a .bt or .ot file says, read by OctoMap itself.
struct OctomapFile {
  double voxel_m = 0;
  bool coloured = false;
  std::size_t free_leaves = 0;
  std::vector<OccupiedCube> occupied;
};

/// Error: BadData when OctoMap cannot read it or it is neither OcTree nor ColorOcTree.
Result<OctomapFile> read_octomap(const std::string& path);

}  // namespace crane
