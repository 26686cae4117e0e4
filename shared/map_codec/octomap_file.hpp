// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// A cube of a map; `size_m` is a multiple of the voxel size.
struct MapCube {
  double x_m = 0, y_m = 0, z_m = 0, size_m = 0;  ///< centre and edge
};

/// What a .bt or .ot file says, read by OctoMap itself.
struct OctomapFile {
  double voxel_m = 0;
  bool coloured = false;
  std::vector<MapCube> occupied, free;
};

/// What is larger is refused: four halls of 60 x 20 m in voxels of 5 cm; OctoMap's tree of it takes
/// some 2 GB.
inline constexpr std::uintmax_t kMaxOctomapBytes = std::uintmax_t{512} << 20U;
inline constexpr std::uint64_t kMaxOctomapNodes = 50'000'000;

/// Error: BadData saying what is wrong when the file is missing, cut, damaged, holds more or fewer
/// nodes than it declares, or is neither OcTree nor ColorOcTree.
Result<OctomapFile> read_octomap(const std::string& path);

/// Writes a .bt file as .ot, without colour: for viewers that open nothing else.
/// Error: as read_octomap(); Resource when it cannot be written.
Result<void> convert_bt_to_ot(const std::string& bt_path, const std::string& ot_path);

/// What the header and the bytes of such a file promise, checked without making a tree: every node
/// lies within the bytes, none lies deeper than OctoMap's 16 levels, their number is the declared
/// one and nothing follows the last. Memory O(1). Error: BadData.
struct OctomapHeader {
  bool binary = false;  ///< .bt
  std::string id;
  std::uint64_t nodes = 0;
  double voxel_m = 0;
};
Result<OctomapHeader> check_octomap(std::span<const std::uint8_t> file, const std::string& name);
/// The same from bytes in memory.
Result<OctomapFile> decode_octomap(const std::vector<std::uint8_t>& file, const std::string& name);

}  // namespace crane
