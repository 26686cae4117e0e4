// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <unordered_map>
#include <vector>

#include "client/clearance_check.hpp"
#include "map_codec/octomap_file.hpp"
#include "mapping/occupancy_map.hpp"
#include "recording/truth.hpp"

namespace crane {

/// A map as it is judged: what is said of each voxel, and what the client library would make of
/// it. Of a file only the part near the truth.
class JudgedMap {
 public:
  /// Error: BadData when the voxels are so fine that the part would not fit into 1 GiB.
  static Result<JudgedMap> from_file(const OctomapFile& file, const HeightMap& truth);
  /// Whole, with its heights, as a controller would hold it.
  static JudgedMap from_map(const OccupancyMap& map);

  [[nodiscard]] double voxel_m() const { return voxel_m_; }
  [[nodiscard]] int index(double metres) const {
    return static_cast<int>(std::floor(metres / voxel_m_));
  }
  /// Voxel index of each axis.
  [[nodiscard]] Occupancy at(int x, int y, int z) const;
  /// Upper side of a column's highest occupied voxel; -infinity = none.
  [[nodiscard]] double top_m(int x, int y) const;
  /// Lives no longer than this map.
  [[nodiscard]] client::ColumnView view() const;
  [[nodiscard]] const std::vector<MapCube>& occupied() const { return occupied_; }

 private:
  explicit JudgedMap(double voxel_m) : voxel_m_(voxel_m) {}
  struct HeldTile {
    ColumnTile voxels;
    HeightColumns heights;
    std::vector<int> top;  ///< by column: highest occupied voxel
  };
  using Blocks = std::unordered_map<TileKey, std::map<int, BlockClasses>, TileKeyHash>;
  void hold(const Blocks& blocks);
  [[nodiscard]] const HeldTile* find(int x, int y) const;

  double voxel_m_;
  bool with_heights_ = false;
  std::vector<MapCube> occupied_;
  std::unordered_map<TileKey, HeldTile, TileKeyHash> tiles_;
};

}  // namespace crane
