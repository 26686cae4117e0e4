// SPDX-License-Identifier: Apache-2.0
#include "client/safe_height.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "client/tile_row.hpp"

namespace crane::client {
namespace {

/// Which levels are free in all of the columns.
class CommonLevels {
 public:
  /// Adds columns first .. first + count - 1 of a tile.
  void add(const ColumnTile* tile, int first, int count) {
    if (tile == nullptr || tile->words == 0) {
      nothing_known_ = true;
      return;
    }
    std::vector<std::uint64_t>& common = common_[{tile->z0, tile->words}];
    common.resize(std::size_t(tile->words), ~std::uint64_t{0});
    for (int w = 0; w < tile->words; ++w) {
      const std::uint64_t* free = tile->free.data() + w * kTileColumns + first;
      std::uint64_t all = ~std::uint64_t{0};
      for (int i = 0; i < count; ++i) all &= free[i];
      common[std::size_t(w)] &= all;
    }
  }
  [[nodiscard]] bool nothing_known() const { return nothing_known_; }
  [[nodiscard]] std::vector<FreeRun> runs() const {
    std::vector<FreeRun> out;
    if (nothing_known_ || common_.empty()) return out;
    int from = std::numeric_limits<int>::min();  // levels that all tiles hold
    int to = std::numeric_limits<int>::max();
    for (const auto& [levels, bits] : common_) {
      from = std::max(from, levels.first);
      to = std::min(to, levels.first + 64 * levels.second);
    }
    for (int z = from; z < to; ++z) {
      const bool free = std::all_of(common_.begin(), common_.end(), [z](const auto& tile) {
        const int at = z - tile.first.first;
        return (tile.second[std::size_t(at / 64)] >> (at % 64) & 1U) != 0;
      });
      if (!free) continue;
      if (out.empty() || out.back().end != z) out.push_back({z, z});
      out.back().end = z + 1;
    }
    return out;
  }

 private:
  std::map<std::pair<int, int>, std::vector<std::uint64_t>> common_;  ///< by first level and words
  bool nothing_known_ = false;
};

}  // namespace

std::vector<FreeRun> free_runs(const std::vector<SweptPiece>& pieces, const ColumnView& map) {
  CommonLevels levels;
  TileRow tiles(map);
  for (const SweptPiece& piece : pieces)
    for (const PolygonRow& row : rows_of(piece.hull, map.voxel_m))
      for (int x = row.first; x <= row.last; x += kTileEdge - in_tile(x)) {
        levels.add(tiles.at(tile_of(x), tile_of(row.row)).voxels,
                   in_tile(row.row) * kTileEdge + in_tile(x),
                   std::min(row.last - x, kTileEdge - 1 - in_tile(x)) + 1);
        if (levels.nothing_known()) return {};
      }
  return levels.runs();
}

std::optional<HeightInterval> next_clear(const ClearanceQuery& query, const ColumnView& map,
                                         const std::vector<FreeRun>& runs,
                                         const std::vector<const Zone*>& no_go, double asked_m) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double margin_m = query.margins.vertical_m;
  const bool to_rope_top = query.load.above_m < 0;
  // From the underside up to the highest point that must be free, however high the load is.
  const double box_m = query.load.size_z_m + margin_m;
  const double up_m = to_rope_top ? box_m : box_m + query.load.above_m;
  std::vector<HeightInterval> clear;
  for (const FreeRun& run : runs) {
    if (to_rope_top && run.end * map.voxel_m < map.ceiling_m - kRounding * map.voxel_m) continue;
    const HeightInterval fits{run.first * map.voxel_m + margin_m, run.end * map.voxel_m - up_m};
    if (fits.low_m <= fits.high_m) clear.push_back(fits);
  }
  for (const Zone* zone : no_go) {
    // Strictly between these the load, or what it hangs from, is in the zone.
    const bool rope_in_zone = to_rope_top && map.ceiling_m > zone->z_min_m;
    const double from = rope_in_zone ? -kInfinity : zone->z_min_m - up_m;
    const double to = zone->z_max_m + margin_m;
    std::vector<HeightInterval> left;
    for (const HeightInterval& c : clear) {
      if (std::min(c.high_m, from) >= c.low_m) left.push_back({c.low_m, std::min(c.high_m, from)});
      if (std::max(c.low_m, to) <= c.high_m) left.push_back({std::max(c.low_m, to), c.high_m});
    }
    clear = std::move(left);
  }
  const auto found = std::find_if(clear.begin(), clear.end(), [asked_m](const HeightInterval& c) {
    return c.high_m >= asked_m;
  });
  if (found == clear.end()) return std::nullopt;
  return *found;
}

}  // namespace crane::client
