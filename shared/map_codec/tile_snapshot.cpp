#include "map_codec/tile_snapshot.hpp"

#include <cstring>

#include "map_codec/byte_order.hpp"
#include "map_codec/crc32c.hpp"

namespace crane {
namespace {

constexpr std::uint32_t kMagic = 0x31534D43;  // "CMS1"
constexpr std::size_t kHeader = 4 + 4 + 4 + 4;
constexpr std::size_t kTimes = std::size_t(kTileColumns) * 8;
constexpr std::size_t kLayer = std::size_t(kTileColumns) * 5;
constexpr std::size_t kMaxBytes = 64U << 20U;

Error damaged(const char* what) {
  return {ErrorCode::kBadData, "saved tile", what, ""};
}

}  // namespace

Bytes write_snapshot(const Tile& tile) {
  Bytes raw;
  put_le(raw, kMagic, 4);
  put_le(raw, static_cast<std::uint32_t>(tile.key.x), 4);
  put_le(raw, static_cast<std::uint32_t>(tile.key.y), 4);
  put_le(raw, tile.blocks.size(), 4);
  for (TimeNs t : tile.last_observed) put_le(raw, static_cast<std::uint64_t>(t), 8);
  for (const auto& [bz, block] : tile.blocks) {
    put_le(raw, static_cast<std::uint32_t>(bz), 4);
    std::uint32_t layers = 0;
    for (std::size_t z = 0; z < kTileEdge; ++z) layers |= (block->surface[z] ? 1U : 0U) << z;
    put_le(raw, layers, 4);
    const std::size_t at = raw.size();
    raw.resize(at + block->log_odds.size());
    std::memcpy(raw.data() + at, block->log_odds.data(), block->log_odds.size());
    for (const auto& layer : block->surface) {
      if (!layer) continue;
      for (const Surface& s : *layer)
        for (int v : {int(std::uint8_t(s.offset)), int(s.weight), int(s.r), int(s.g), int(s.b)})
          raw.push_back(static_cast<std::uint8_t>(v));
    }
  }
  Bytes packed = compress(raw, 1);
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
  if (raw.size() < kHeader + kTimes || get_le(raw, 0, 4) != kMagic) return damaged("is none");
  Tile& tile = map.tile(
      {static_cast<std::int32_t>(get_le(raw, 4, 4)), static_cast<std::int32_t>(get_le(raw, 8, 4))});
  const std::uint64_t count = get_le(raw, 12, 4);
  std::size_t at = kHeader;
  for (TimeNs& t : tile.last_observed) {
    t = static_cast<TimeNs>(get_le(raw, at, 8));
    at += 8;
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    if (raw.size() - at < 8 + kBlockVoxels) return damaged("ends early");
    Block* block = map.block(tile, static_cast<std::int32_t>(get_le(raw, at, 4)));
    if (block == nullptr)
      return Error{ErrorCode::kResource, "saved map", "exceeds mapper.max_memory_mib", "raise it"};
    const auto layers = static_cast<std::uint32_t>(get_le(raw, at + 4, 4));
    at += 8;
    std::memcpy(block->log_odds.data(), raw.data() + at, kBlockVoxels);
    at += kBlockVoxels;
    for (std::size_t z = 0; z < kTileEdge; ++z) {
      if ((layers >> z & 1U) == 0) continue;
      if (raw.size() - at < kLayer) return damaged("ends early");
      block->surface[z] = std::make_unique<std::array<Surface, kTileColumns>>();
      for (Surface& s : *block->surface[z]) {
        s = {static_cast<std::int8_t>(raw[at]), raw[at + 1], raw[at + 2], raw[at + 3], raw[at + 4]};
        at += 5;
      }
    }
  }
  tile.changed = tile.reclassified = true;
  return {};
}

}  // namespace crane
