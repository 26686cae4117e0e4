// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "map_codec/tile_codec.hpp"
#include "map_sync/column_tile.hpp"

namespace crane {

/// What came of putting something into the map that is held.
enum class Put {
  kHeld,
  kOlder,   ///< a later revision of it is held: nothing was done
  kNoRoom,  ///< it would pass the bound of memory: nothing was done
};

/// What a subscriber holds of one map, within a bound of memory. No DDS; one writer, any number of
/// readers, locked by the owner.
class HeldMap {
 public:
  static constexpr std::size_t kNoBound = std::numeric_limits<std::size_t>::max();
  /// `max_bytes`: of all that is held; beside it only the tile that is being put.
  explicit HeldMap(std::uint64_t map_id = 0, std::size_t max_bytes = kNoBound)
      : map_id_(map_id), max_bytes_(max_bytes) {}

  /// Voxels of one band, ready to be put: made by the writer without a lock.
  struct Voxels {
    BandKey key;
    std::uint64_t revision = 0;
    std::uint32_t crc = 0;
    std::map<int, BlockClasses> blocks;  ///< of all bands of the tile
    ColumnTile columns;                  ///< the same, column by column; empty without room
    std::size_t bytes = 0;               ///< of both
  };
  [[nodiscard]] Voxels prepare(BandKey key, std::uint64_t revision, std::uint32_t crc,
                               const DecodedTile& decoded) const;
  Put put(Voxels voxels);
  Put put(TileKey key, std::uint64_t revision, std::uint32_t crc, const HeightColumns& heights);
  /// Whoever goes on with the map counts its revisions anew: what it says next is later than all
  /// that is held.
  void forget_revisions();
  void remove_voxels(BandKey key);
  void remove_heights(TileKey key);

  [[nodiscard]] std::uint64_t map_id() const { return map_id_; }
  /// As the allocator gives it, but for its own few bytes a piece.
  [[nodiscard]] std::size_t memory_bytes() const { return bytes_; }
  [[nodiscard]] std::size_t max_bytes() const { return max_bytes_; }
  [[nodiscard]] const ColumnTile* columns(TileKey key) const;
  [[nodiscard]] const HeightColumns* heights(TileKey key) const;
  [[nodiscard]] std::uint32_t voxel_tiles() const { return voxel_tiles_; }
  [[nodiscard]] std::uint32_t height_tiles() const { return height_tiles_; }
  [[nodiscard]] const BucketDigests& voxel_digests() const { return voxel_digests_; }
  [[nodiscard]] const BucketDigests& height_digests() const { return height_digests_; }

  struct Sample {
    std::uint64_t revision = 0;
    std::uint32_t crc = 0;
  };
  struct HeldTile {
    std::map<int, Sample> bands;
    std::map<int, BlockClasses> blocks;
    ColumnTile columns;
    std::optional<Sample> heights_sample;
    HeightColumns heights;
    std::size_t voxel_bytes = 0;  ///< of blocks and columns
  };
  using Tiles = std::unordered_map<TileKey, HeldTile, TileKeyHash>;
  [[nodiscard]] const Tiles& tiles() const { return tiles_; }

 private:
  [[nodiscard]] bool fits(TileKey key, std::size_t voxel_bytes) const;
  void drop_if_empty(Tiles::iterator tile);

  std::uint64_t map_id_;
  std::size_t max_bytes_, bytes_ = 0;
  Tiles tiles_;
  BucketDigests voxel_digests_, height_digests_;
  std::uint32_t voxel_tiles_ = 0, height_tiles_ = 0;
};

}  // namespace crane
