// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "map_codec/compression.hpp"
#include "mapping/heights.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

// Versioned bytes of one tile, little-endian, zstd over all of it. idl/README.md has the layout.

inline constexpr std::uint32_t kTileEncoding = 1;

/// Blocks on top of each other travel in bands of so many: the largest that fits a UDP datagram
/// however badly it packs. Band 0 begins with the block below the floor.
inline constexpr int kBandBlocks = 7;
constexpr int band_of(int block_z) {
  return block_z + 1 >= 0 ? (block_z + 1) / kBandBlocks : -((-block_z - 2) / kBandBlocks) - 1;
}
constexpr int first_block(int band) {
  return band * kBandBlocks - 1;
}

/// Where tiles can be on the network: their indices are 16 bits wide.
inline constexpr int kFarthestTile = 32'767;
/// Blocks that a map may have on top of each other; those far outside are not published.
inline constexpr int kHighestBlock = 1023;

/// One tile on the network.
struct BandKey {
  std::int16_t x = 0, y = 0, z = 0;
  auto operator<=>(const BandKey&) const = default;
  [[nodiscard]] TileKey tile() const { return {x, y}; }
};

/// Classes of one 32 x 32 x 32 block, 2 bits each (0 unknown, 1 free, 2 occupied),
/// index (z * 32 + y) * 32 + x, four to a byte from the low bits.
using BlockClasses = std::array<std::uint8_t, kBlockVoxels / 4>;

struct DecodedTile {
  std::map<int, BlockClasses> blocks;  ///< by block height index
  [[nodiscard]] Occupancy at(int x_in_tile, int y_in_tile, int z) const;
};

/// Bands of a tile with anything known.
std::vector<int> known_bands(const Tile& tile);
Bytes encode_tile(const Tile& tile, int band);
/// Error: BadData for anything that encode_tile() does not write for that band.
Result<DecodedTile> decode_tile(std::span<const std::uint8_t> payload, int band);

using TileHeights = std::array<ColumnHeight, kTileColumns>;

/// Whether anything is known of any column.
bool any_known(const TileHeights& heights);
/// Heights to 0.1 mm, spread to 0.1 mm, times to 1 s.
Bytes encode_heights(const TileHeights& heights);
Result<TileHeights> decode_heights(std::span<const std::uint8_t> payload);

/// A tile's share of the map digest; the digest is the sum over all tiles modulo 2^64, so it does
/// not depend on their order and is kept up to date with one subtraction and one addition. Height
/// tiles have z = 0.
std::uint64_t tile_digest(BandKey key, std::uint32_t crc);

/// Digests over the tiles of each bucket, and over all: to find out what a subscriber lacks.
inline constexpr std::size_t kBuckets = 64;
struct BucketDigests {
  std::array<std::uint64_t, kBuckets> buckets{};
  std::uint64_t all = 0;

  static std::size_t bucket_of(TileKey key) {
    return static_cast<std::size_t>(key.x * 7 + key.y * 13) % kBuckets;
  }
  void add(BandKey key, std::uint32_t crc) { change(key, tile_digest(key, crc)); }
  void remove(BandKey key, std::uint32_t crc) { change(key, ~tile_digest(key, crc) + 1); }

 private:
  void change(BandKey key, std::uint64_t by) {
    buckets[bucket_of(key.tile())] += by;
    all += by;
  }
};

}  // namespace crane
