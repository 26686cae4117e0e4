#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "client/column_tile.hpp"
#include "crane/client/zone.hpp"
#include "map_codec/tile_codec.hpp"

namespace crane::client {

/// What a client holds of one map. No DDS; one writer, any number of readers, locked by the owner.
class HeldMap {
 public:
  explicit HeldMap(std::uint64_t map_id = 0) : map_id_(map_id) {}

  /// Voxels of one band, ready to be put: made by the writer without a lock.
  struct Voxels {
    BandKey key;
    std::uint64_t revision = 0;
    std::uint32_t crc = 0;
    std::map<int, BlockClasses> blocks;  ///< of all bands of the tile
    ColumnTile columns;                  ///< the same, column by column
  };
  [[nodiscard]] Voxels prepare(BandKey key, std::uint64_t revision, std::uint32_t crc,
                               const DecodedTile& decoded) const;
  /// False, and nothing done, when a later revision of it is held.
  bool put(Voxels voxels);
  bool put(TileKey key, std::uint64_t revision, std::uint32_t crc, const HeightColumns& heights);
  void remove_voxels(BandKey key);
  void remove_heights(TileKey key);
  void put(std::uint64_t revision, std::vector<Zone> zones);

  [[nodiscard]] std::uint64_t map_id() const { return map_id_; }
  [[nodiscard]] const ColumnTile* columns(TileKey key) const;
  [[nodiscard]] const HeightColumns* heights(TileKey key) const;
  [[nodiscard]] const std::vector<Zone>& zones() const { return zones_; }
  [[nodiscard]] std::uint64_t zones_revision() const { return zones_revision_; }
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
  };
  [[nodiscard]] const std::unordered_map<TileKey, HeldTile, TileKeyHash>& tiles() const {
    return tiles_;
  }

 private:
  std::uint64_t map_id_;
  std::unordered_map<TileKey, HeldTile, TileKeyHash> tiles_;
  BucketDigests voxel_digests_, height_digests_;
  std::uint32_t voxel_tiles_ = 0, height_tiles_ = 0;
  std::vector<Zone> zones_;
  std::uint64_t zones_revision_ = 0;
};

}  // namespace crane::client
