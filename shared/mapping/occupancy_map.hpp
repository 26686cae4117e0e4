// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "base/clock.hpp"
#include "cloud/point_cloud.hpp"
#include "mapping/epoch.hpp"

namespace crane {

/// Edge of tiles (columns) and blocks (voxels).
inline constexpr int kTileEdge = 32;
inline constexpr int kTileColumns = kTileEdge * kTileEdge;
inline constexpr int kBlockVoxels = kTileColumns * kTileEdge;

/// Edge of the cubes of voxels that are looked at together.
inline constexpr int kCube = 8;
inline constexpr int kCubesEdge = kTileEdge / kCube;

/// Log-odds in 1/32; hit and miss are OctoMap's defaults (0.85, -0.4). The limits are narrow, so
/// that three observations that agree turn anything: of an obstacle that left or one that came.
inline constexpr int kHit = 27, kMiss = -13, kLogOddsMin = -26, kLogOddsMax = 38;

/// From here on a voxel is believed to be occupied: one certain observation, or several uncertain
/// ones that agree. Between 0 and this it is unknown, never free.
inline constexpr int kBelieved = 20;
/// What a free voxel becomes by the first sighting of something in it: unknown, until another
/// agrees. One frame's mismatch never makes an obstacle where others saw through.
inline constexpr int kContested = 6;

enum class Occupancy : std::uint8_t { kUnknown = 0, kFree = 1, kOccupied = 2 };

constexpr Occupancy classify(int log_odds) {
  return log_odds >= kBelieved ? Occupancy::kOccupied
         : log_odds < 0        ? Occupancy::kFree
                               : Occupancy::kUnknown;
}

/// What is known of the surface inside an occupied voxel.
struct Surface {
  std::int8_t offset = 0;  ///< mean height of the points, 1/127 of half a voxel from its centre
  std::uint8_t weight : 7 = 0;   ///< observations, saturating
  std::uint8_t certain : 1 = 0;  ///< one of them at least was as certain as half a voxel
  std::uint8_t r = 0, g = 0, b = 0;
};

/// 32 x 32 x 32 voxels. Log-odds 0 is unknown: nothing was measured there, or too long ago.
struct Block {
  std::array<std::int8_t, kBlockVoxels> log_odds{};  ///< index (z * 32 + y) * 32 + x
  std::array<Epoch, kBlockVoxels> seen{};            ///< when last measured
  /// Epoch in which all voxels of a cube were last as free as can be: nothing is left to do there
  /// before the next. Index (z * 4 + y) * 4 + x.
  std::array<Epoch, kCubesEdge * kCubesEdge * kCubesEdge> settled{};
  std::array<std::unique_ptr<std::array<Surface, kTileColumns>>, kTileEdge> surface;  ///< per layer

  [[nodiscard]] Occupancy at(int index) const {
    return classify(log_odds[static_cast<std::size_t>(index)]);
  }
};

struct TileKey {
  std::int32_t x = 0, y = 0;
  auto operator<=>(const TileKey&) const = default;
};

struct TileKeyHash {
  std::size_t operator()(const TileKey& k) const {
    return (std::uint64_t(std::uint32_t(k.x)) << 32U | std::uint32_t(k.y)) * 0x9E3779B97F4A7C15ULL;
  }
};

/// What is known of a map column beside its voxels.
struct Column {
  TimeNs last_observed = 0;  ///< exposure that last saw a surface here; 0 = never
  /// Lowest voxel that hook or load have passed, with all above it up to the hook, since a surface
  /// was last seen higher; kNotProven = none.
  std::int16_t proven_z = kNotProven;
  bool stale = false;  ///< its surface was not seen again for too long, and is forgotten
  static constexpr std::int16_t kNotProven = 32'767;
};

/// A column of blocks over 32 x 32 map columns.
struct Tile {
  TileKey key;
  std::map<int, std::unique_ptr<Block>> blocks;  ///< by block height index
  std::array<Column, kTileColumns> columns{};    ///< index y * 32 + x
  // Since the flags were last cleared:
  bool changed = false;       ///< anything: see OccupancyMap::mark_changed()
  bool reclassified = false;  ///< a voxel became free, occupied or unknown
  bool moved = false;         ///< a surface by more than a millimetre
  bool listed = false;        ///< among the map's changed tiles
};

/// Occupancy in XY tiles. What it costs to change depends on what is seen, not on its size.
/// Voxel (i, j, k) covers [i, i+1) * voxel_m in x and so on. Not thread-safe.
class OccupancyMap {
 public:
  OccupancyMap(double voxel_m, std::size_t max_bytes) : voxel_m_(voxel_m), max_bytes_(max_bytes) {}

  [[nodiscard]] double voxel_m() const { return voxel_m_; }
  [[nodiscard]] int index(double metres) const {
    return static_cast<int>(std::floor(metres / voxel_m_));
  }
  [[nodiscard]] double centre(int index) const { return (index + 0.5) * voxel_m_; }

  /// The tile, made when absent; nullptr when the memory limit is reached.
  Tile* tile_if_room(TileKey key);
  /// A tile that is there, or that there is room for: a bug when there is none.
  Tile& tile(TileKey key);
  [[nodiscard]] const Tile* find(TileKey key) const;
  /// The block, made when absent; nullptr when the memory limit is reached. May be called from
  /// several threads for different tiles.
  Block* block(Tile& tile, int block_z);

  [[nodiscard]] Occupancy at(int x, int y, int z) const;

  /// Tiles in key order, so that whatever is made of the map is reproducible.
  [[nodiscard]] std::vector<const Tile*> tiles() const;
  /// Likewise, those with `changed` set. Cost O(changed tiles).
  [[nodiscard]] std::vector<Tile*> changed_tiles();
  /// Whoever sets a tile's flags says so here, from one thread.
  void mark_changed(Tile& tile);
  [[nodiscard]] std::size_t tile_count() const { return tiles_.size(); }
  [[nodiscard]] std::vector<TileKey> tile_keys() const;

  [[nodiscard]] std::size_t memory_bytes() const { return bytes_; }
  /// Blocks, tiles and layers of surfaces that were not made because of the memory limit.
  [[nodiscard]] std::uint64_t refused_blocks() const { return refused_; }

  /// Surfaces of a layer of voxels, made when absent; nullptr when the memory limit is reached.
  std::array<Surface, kTileColumns>* layer(Block& block, std::size_t z);

  /// When it is now, for the ages of voxels.
  [[nodiscard]] Epoch epoch() const { return epoch_; }
  void set_epoch(Epoch epoch) { epoch_ = epoch; }

  /// Merges one frame's mean height (map z) and colour into the surface of a voxel. True when that
  /// moved it by more than a millimetre.
  /// Without room for it nothing is merged, and the voxel's centre stands for its surface.
  /// `share`: of the mean, that this sighting makes; kAlike: as much as each certain one before.
  bool observe_surface(Block& block, int index, int voxel_z, double height_m, std::uint8_t r,
                       std::uint8_t g, std::uint8_t b, double share = kAlike);
  static constexpr double kAlike = -1;
  /// Height of the surface in an occupied voxel [m].
  [[nodiscard]] double surface_height_m(const Block& block, int index, int voxel_z) const;

  /// Centre (with sub-voxel height) and colour of every occupied voxel.
  [[nodiscard]] PointCloud occupied_points() const;

 private:
  /// Takes so much of the limit, from any thread; false, and counted, when it is not there.
  bool reserve(std::size_t bytes);

  double voxel_m_;
  std::size_t max_bytes_;
  Epoch epoch_ = 1;
  std::atomic<std::size_t> bytes_ = 0;
  std::atomic<std::uint64_t> refused_ = 0;
  std::vector<Tile*> changed_;
  std::unordered_map<TileKey, std::unique_ptr<Tile>, TileKeyHash> tiles_;
};

/// One sighting in a voxel, of a strength of up to kHit.
inline void see_occupied(std::int8_t& log_odds, int strength) {
  log_odds = static_cast<std::int8_t>(
      log_odds < 0 ? kContested : std::min<int>(log_odds + strength, kLogOddsMax));
}

/// A surface was seen in a voxel of a column: what passed there before proves nothing below it.
inline void saw_surface(Column& column, int voxel_z, TimeNs exposure) {
  column.last_observed = exposure;
  column.stale = false;
  if (voxel_z >= column.proven_z) column.proven_z = Column::kNotProven;
}

/// Floor division and remainder for voxel to tile indices.
constexpr int tile_of(int voxel) {
  return voxel >> 5;
}
constexpr int in_tile(int voxel) {
  return voxel & 31;
}

}  // namespace crane
