// SPDX-License-Identifier: Apache-2.0
#include "map_codec/tile_snapshot.hpp"

#include <cstring>

#include "map_codec/byte_order.hpp"
#include "map_codec/crc32c.hpp"

namespace crane {
namespace {

constexpr std::uint32_t kMagic = 0x32534D43;  // "CMS2"
constexpr std::size_t kHeader = 4 + 4 + 4 + 4;
constexpr std::size_t kColumns = std::size_t(kTileColumns) * (8 + 2 + 1);
constexpr std::size_t kBlock = 4 + 4 + 2 * std::size_t(kBlockVoxels);
constexpr std::size_t kLayer = std::size_t(kTileColumns) * sizeof(Surface);
static_assert(sizeof(Surface) == 5);  // bytes only: written as it is in memory
constexpr std::size_t kMaxBytes = 64U << 20U;

Error damaged(const char* what) {
  return {ErrorCode::kBadData, "saved tile", what, ""};
}

}  // namespace

Bytes tile_bytes(const Tile& tile) {
  Bytes raw;
  put_le(raw, kMagic, 4);
  put_le(raw, static_cast<std::uint32_t>(tile.key.x), 4);
  put_le(raw, static_cast<std::uint32_t>(tile.key.y), 4);
  put_le(raw, tile.blocks.size(), 4);
  for (const Column& c : tile.columns) {
    put_le(raw, static_cast<std::uint64_t>(c.last_observed), 8);
    put_le(raw, static_cast<std::uint16_t>(c.proven_z), 2);
    put_le(raw, c.stale ? 1 : 0, 1);
  }
  for (const auto& [bz, block] : tile.blocks) {
    put_le(raw, static_cast<std::uint32_t>(bz), 4);
    std::uint32_t layers = 0;
    for (std::size_t z = 0; z < kTileEdge; ++z) layers |= (block->surface[z] ? 1U : 0U) << z;
    put_le(raw, layers, 4);
    const std::size_t at = raw.size();
    raw.resize(at + 2 * kBlockVoxels);
    std::memcpy(raw.data() + at, block->log_odds.data(), kBlockVoxels);
    std::memcpy(raw.data() + at + kBlockVoxels, block->seen.data(), kBlockVoxels);
    for (const auto& layer : block->surface) {
      if (!layer) continue;
      const std::size_t start = raw.size();
      raw.resize(start + kLayer);
      std::memcpy(raw.data() + start, layer->data(), kLayer);
    }
  }
  return raw;
}

Bytes pack_snapshot(const Bytes& tile_bytes) {
  Bytes packed = compress(tile_bytes, 1);
  put_le(packed, crc32c(packed), 4);
  return packed;
}

Result<void> read_snapshot(std::span<const std::uint8_t> bytes, OccupancyMap& map) {
  if (bytes.size() < 8) return damaged("is too short");
  const auto packed = bytes.first(bytes.size() - 4);
  if (get_le(bytes, packed.size(), 4) != crc32c(packed)) return damaged("fails its checksum");
  auto unpacked = decompress(packed, kMaxBytes);
  if (!unpacked) return unpacked.error();
  const Bytes& raw = *unpacked;
  if (raw.size() < kHeader + kColumns || get_le(raw, 0, 4) != kMagic) return damaged("is none");
  const Error no_room{ErrorCode::kResource, "saved map", "exceeds mapper.max_memory_mib",
                      "raise it"};
  Tile* const made = map.tile_if_room(
      {static_cast<std::int32_t>(get_le(raw, 4, 4)), static_cast<std::int32_t>(get_le(raw, 8, 4))});
  if (made == nullptr) return no_room;
  Tile& tile = *made;
  const std::uint64_t count = get_le(raw, 12, 4);
  std::size_t at = kHeader;
  for (Column& c : tile.columns) {
    c.last_observed = static_cast<TimeNs>(get_le(raw, at, 8));
    c.proven_z = static_cast<std::int16_t>(get_le(raw, at + 8, 2));
    c.stale = get_le(raw, at + 10, 1) != 0;
    at += 11;
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    if (raw.size() - at < kBlock) return damaged("ends early");
    Block* block = map.block(tile, static_cast<std::int32_t>(get_le(raw, at, 4)));
    if (block == nullptr) return no_room;
    const auto layers = static_cast<std::uint32_t>(get_le(raw, at + 4, 4));
    at += 8;
    std::memcpy(block->log_odds.data(), raw.data() + at, kBlockVoxels);
    std::memcpy(block->seen.data(), raw.data() + at + kBlockVoxels, kBlockVoxels);
    at += 2 * kBlockVoxels;
    for (std::size_t z = 0; z < kTileEdge; ++z) {
      if ((layers >> z & 1U) == 0) continue;
      if (raw.size() - at < kLayer) return damaged("ends early");
      auto* const surfaces = map.layer(*block, z);
      if (surfaces == nullptr) return no_room;
      std::memcpy(surfaces->data(), raw.data() + at, kLayer);
      at += kLayer;
    }
  }
  tile.reclassified = true;
  map.mark_changed(tile);
  return {};
}

}  // namespace crane
