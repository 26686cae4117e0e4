// SPDX-License-Identifier: Apache-2.0
#include "map_codec/tile_codec.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "map_codec/byte_order.hpp"

namespace crane {
namespace {

constexpr std::uint32_t kTileMagic = 0x31564D43;    // "CMV1"
constexpr std::uint32_t kHeightMagic = 0x33484D43;  // "CMH3"
constexpr std::size_t kBlockBytes = 4 + kBlockVoxels / 4;
constexpr std::size_t kHeightBytes = 4 + kTileColumns * (4 + 2 + 1 + 4 + 4 + 1 + 4);
constexpr unsigned kStateBits = 3;      // of the state: ColumnState
constexpr unsigned kLowerBoundBit = 4;  // ... and whether the height is a lower bound
constexpr std::int64_t kNotProven = 0x7FFFFFFF;
constexpr int kLevel = 1;
constexpr double kUnit = 1e-4;  // 0.1 mm

Error damaged(const char* what) {
  return {ErrorCode::kBadData, "tile", what, ""};
}

bool has_content(const Block& block) {
  return std::any_of(block.log_odds.begin(), block.log_odds.end(),
                     [](auto v) { return classify(v) != Occupancy::kUnknown; });
}

}  // namespace

Occupancy DecodedTile::at(int x, int y, int z) const {
  const auto it = blocks.find(tile_of(z));
  if (it == blocks.end()) return Occupancy::kUnknown;
  const auto i = static_cast<std::size_t>((in_tile(z) * kTileEdge + y) * kTileEdge + x);
  return static_cast<Occupancy>(it->second[i / 4] >> (2 * (i % 4)) & 3U);
}

std::vector<int> known_bands(const Tile& tile) {
  std::vector<int> out;
  for (const auto& [bz, block] : tile.blocks)
    if (std::abs(bz) <= kHighestBlock && (out.empty() || out.back() != band_of(bz)) &&
        has_content(*block))
      out.push_back(band_of(bz));
  return out;
}

Bytes encode_tile(const Tile& tile, int band) {
  Bytes raw;
  put_le(raw, kTileMagic, 4);
  put_le(raw, 0, 4);
  std::uint8_t count = 0;
  const auto end = tile.blocks.lower_bound(first_block(band + 1));
  for (auto it = tile.blocks.lower_bound(first_block(band)); it != end; ++it) {
    const Block* block = it->second.get();
    if (!has_content(*block)) continue;
    ++count;
    put_le(raw, static_cast<std::uint32_t>(it->first), 4);
    const std::size_t start = raw.size();
    raw.resize(start + kBlockVoxels / 4);
    for (std::size_t i = 0; i < kBlockVoxels; i += 4) {
      unsigned byte = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        byte |= static_cast<unsigned>(classify(block->log_odds[i + k])) << (2 * k);
      }
      raw[start + i / 4] = static_cast<std::uint8_t>(byte);
    }
  }
  raw[4] = count;
  return compress(raw, kLevel);
}

Result<DecodedTile> decode_tile(std::span<const std::uint8_t> payload, int band) {
  auto raw = decompress(payload, 8 + kBandBlocks * kBlockBytes);
  if (!raw) return raw.error();
  if (raw->size() < 8 || get_le(*raw, 0, 4) != kTileMagic) return damaged("is no voxel tile");
  const std::size_t count = get_le(*raw, 4, 4);
  if (count > std::size_t{kBandBlocks} || raw->size() != 8 + count * kBlockBytes)
    return damaged("has another size than its header says");
  DecodedTile tile;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = 8 + i * kBlockBytes;
    const auto bz = static_cast<std::int32_t>(get_le(*raw, at, 4));
    if (band_of(bz) != band || std::abs(bz) > kHighestBlock || tile.blocks.contains(bz))
      return damaged("has a block out of range or twice");
    BlockClasses& classes = tile.blocks[bz];
    std::memcpy(classes.data(), raw->data() + at + 4, classes.size());
    for (std::uint8_t byte : classes)
      if ((byte & byte >> 1U & 0x55U) != 0) return damaged("has a voxel of unknown class");
  }
  return tile;
}

bool any_known(const TileHeights& heights) {
  return std::any_of(heights.begin(), heights.end(), [](const ColumnHeight& c) {
    return c.state != ColumnState::kUnknown || c.last_observed != 0 || std::isfinite(c.proven_m);
  });
}

Bytes encode_heights(const TileHeights& heights) {
  Bytes raw;
  raw.reserve(kHeightBytes);
  put_le(raw, kHeightMagic, 4);
  const auto unit = [](double metres, double low, double high) {
    return static_cast<std::int64_t>(std::lround(std::clamp(metres / kUnit, low, high)));
  };
  for (const ColumnHeight& c : heights)
    put_le(raw, is_known(c.state) ? std::uint64_t(unit(c.height_m, -2e9, 2e9)) : 0, 4);
  for (const ColumnHeight& c : heights)
    put_le(raw, is_known(c.state) ? std::uint64_t(unit(c.spread_m, 0, 65'535)) : 0, 2);
  for (const ColumnHeight& c : heights)
    put_le(raw, unsigned(c.state) | (is_known(c.state) && c.lower_bound ? kLowerBoundBit : 0), 1);
  for (const ColumnHeight& c : heights)
    put_le(raw, std::uint64_t(c.last_observed / kNsPerSecond), 4);
  for (const ColumnHeight& c : heights)
    put_le(raw, std::uint64_t(std::isfinite(c.proven_m) ? unit(c.proven_m, -2e9, 2e9) : kNotProven),
           4);
  for (const ColumnHeight& c : heights) put_le(raw, is_known(c.state) ? c.views : 0U, 1);
  for (const ColumnHeight& c : heights)
    put_le(raw, is_known(c.state) ? std::uint64_t(unit(c.free_to_m, -2e9, 2e9)) : 0, 4);
  return compress(raw, kLevel);
}

Result<TileHeights> decode_heights(std::span<const std::uint8_t> payload) {
  auto raw = decompress(payload, kHeightBytes);
  if (!raw) return raw.error();
  if (raw->size() != kHeightBytes || get_le(*raw, 0, 4) != kHeightMagic)
    return damaged("is no height tile");
  TileHeights out;
  const std::size_t n = kTileColumns;
  for (std::size_t i = 0; i < n; ++i) {
    ColumnHeight& c = out[i];
    c.height_m = kUnit * static_cast<std::int32_t>(get_le(*raw, 4 + 4 * i, 4));
    c.spread_m = kUnit * double(get_le(*raw, 4 + 4 * n + 2 * i, 2));
    const std::uint64_t state = get_le(*raw, 4 + 6 * n + i, 1);
    c.state = static_cast<ColumnState>(state & kStateBits);
    c.lower_bound = (state & kLowerBoundBit) != 0;
    if (state > (kStateBits | kLowerBoundBit) || (c.lower_bound && !is_known(c.state)))
      return damaged("has a column of unknown state");
    c.last_observed = static_cast<TimeNs>(get_le(*raw, 4 + 7 * n + 4 * i, 4)) * kNsPerSecond;
    const auto proven = static_cast<std::int32_t>(get_le(*raw, 4 + 11 * n + 4 * i, 4));
    if (proven != kNotProven) c.proven_m = kUnit * proven;
    c.views = static_cast<std::uint8_t>(get_le(*raw, 4 + 15 * n + i, 1));
    c.free_to_m = kUnit * static_cast<std::int32_t>(get_le(*raw, 4 + 16 * n + 4 * i, 4));
  }
  return out;
}

std::uint64_t tile_digest(BandKey key, std::uint32_t crc) {
  // splitmix64 over the values
  std::uint64_t h = std::uint64_t(std::uint16_t(key.x)) << 32U |
                    std::uint64_t(std::uint16_t(key.y)) << 16U | std::uint16_t(key.z);
  for (std::uint64_t add : {std::uint64_t{0x9E3779B97F4A7C15ULL}, std::uint64_t{crc}}) {
    h += add;
    h = (h ^ (h >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    h = (h ^ (h >> 27U)) * 0x94D049BB133111EBULL;
    h ^= h >> 31U;
  }
  return h;
}

}  // namespace crane
