#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>

#include "map_codec/compression.hpp"
#include "mapping/heights.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

// Versioned bytes of one tile, little-endian, zstd over all of it. idl/README.md has the layout.

inline constexpr std::uint32_t kTileEncoding = 1;
/// Blocks on top of each other that a tile can carry. The mapper refuses a range of heights with
/// more; the paper's method, which has no range, loses the lowest (strays below the floor).
inline constexpr std::size_t kMaxBlocks = 64;

/// Classes of one 32 x 32 x 32 block, 2 bits each (0 unknown, 1 free, 2 occupied),
/// index (z * 32 + y) * 32 + x, four to a byte from the low bits.
using BlockClasses = std::array<std::uint8_t, kBlockVoxels / 4>;

struct DecodedTile {
  std::map<int, BlockClasses> blocks;  ///< by block height index
  [[nodiscard]] Occupancy at(int x_in_tile, int y_in_tile, int z) const;
};

Bytes encode_tile(const Tile& tile);
/// Error: BadData for anything that encode_tile() does not write.
Result<DecodedTile> decode_tile(std::span<const std::uint8_t> payload);

using TileHeights = std::array<ColumnHeight, kTileColumns>;

/// Heights to 0.1 mm, spread to 0.1 mm, times to 1 s.
Bytes encode_heights(const TileHeights& heights);
Result<TileHeights> decode_heights(std::span<const std::uint8_t> payload);

/// A tile's share of the map digest; the digest is the sum over all tiles modulo 2^64, so it does
/// not depend on their order and is kept up to date with one subtraction and one addition.
std::uint64_t tile_digest(TileKey key, std::uint32_t crc);

}  // namespace crane
