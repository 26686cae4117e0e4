// SPDX-License-Identifier: Apache-2.0
#include "map_sync/held_map.hpp"

#include <utility>

namespace crane {
namespace {

/// A node of a map or of a hash table beside its value.
constexpr std::size_t kNode = 48;
constexpr std::size_t kBlockBytes = sizeof(BlockClasses) + kNode;
constexpr std::size_t kTileBytes = sizeof(HeldMap::HeldTile) + kNode;

std::size_t voxel_bytes(const std::map<int, BlockClasses>& blocks) {
  if (blocks.empty()) return 0;
  return blocks.size() * kBlockBytes + column_bytes(blocks.begin()->first, blocks.rbegin()->first);
}

void erase_band(std::map<int, BlockClasses>& blocks, int band) {
  blocks.erase(blocks.lower_bound(first_block(band)), blocks.lower_bound(first_block(band + 1)));
}

}  // namespace

HeldMap::Voxels HeldMap::prepare(BandKey key, std::uint64_t revision, std::uint32_t crc,
                                 const DecodedTile& decoded) const {
  Voxels out{key, revision, crc, {}, {}, 0};
  if (const auto it = tiles_.find(key.tile()); it != tiles_.end()) out.blocks = it->second.blocks;
  erase_band(out.blocks, key.z);
  out.blocks.insert(decoded.blocks.begin(), decoded.blocks.end());
  out.bytes = voxel_bytes(out.blocks);
  if (fits(key.tile(), out.bytes)) out.columns = columns_of(out.blocks);
  return out;
}

bool HeldMap::fits(TileKey key, std::size_t bytes) const {
  const auto it = tiles_.find(key);
  const std::size_t now = it == tiles_.end() ? 0 : kTileBytes + it->second.voxel_bytes;
  return bytes_ - now + kTileBytes + bytes <= max_bytes_;
}

Put HeldMap::put(Voxels voxels) {
  if (!fits(voxels.key.tile(), voxels.bytes)) return Put::kNoRoom;
  const auto [at, new_tile] = tiles_.try_emplace(voxels.key.tile());
  HeldTile& tile = at->second;
  if (new_tile) bytes_ += kTileBytes;
  const auto [it, fresh] = tile.bands.try_emplace(voxels.key.z);
  if (!fresh) {
    if (voxels.revision < it->second.revision) return Put::kOlder;
    voxel_digests_.remove(voxels.key, it->second.crc);
  }
  voxel_tiles_ += fresh ? 1 : 0;
  voxel_digests_.add(voxels.key, voxels.crc);
  it->second = {voxels.revision, voxels.crc};
  tile.blocks = std::move(voxels.blocks);
  tile.columns = std::move(voxels.columns);
  bytes_ += voxels.bytes - tile.voxel_bytes;
  tile.voxel_bytes = voxels.bytes;
  return Put::kHeld;
}

Put HeldMap::put(TileKey key, std::uint64_t revision, std::uint32_t crc,
                 const HeightColumns& heights) {
  const auto known = tiles_.find(key);
  if (!fits(key, known == tiles_.end() ? 0 : known->second.voxel_bytes)) return Put::kNoRoom;
  const auto [at, new_tile] = tiles_.try_emplace(key);
  HeldTile& tile = at->second;
  if (new_tile) bytes_ += kTileBytes;
  const BandKey digest_key{static_cast<std::int16_t>(key.x), static_cast<std::int16_t>(key.y), 0};
  if (tile.heights_sample) {
    if (revision < tile.heights_sample->revision) return Put::kOlder;
    height_digests_.remove(digest_key, tile.heights_sample->crc);
  }
  height_tiles_ += tile.heights_sample ? 0 : 1;
  height_digests_.add(digest_key, crc);
  tile.heights_sample = Sample{revision, crc};
  tile.heights = heights;
  return Put::kHeld;
}

void HeldMap::forget_revisions() {
  for (auto& [key, tile] : tiles_) {
    for (auto& [band, sample] : tile.bands) sample.revision = 0;
    if (tile.heights_sample) tile.heights_sample->revision = 0;
  }
}

void HeldMap::remove_voxels(BandKey key) {
  const auto it = tiles_.find(key.tile());
  if (it == tiles_.end()) return;
  HeldTile& tile = it->second;
  const auto band = tile.bands.find(key.z);
  if (band == tile.bands.end()) return;
  voxel_digests_.remove(key, band->second.crc);
  --voxel_tiles_;
  tile.bands.erase(band);
  erase_band(tile.blocks, key.z);
  tile.columns = columns_of(tile.blocks);
  bytes_ -= tile.voxel_bytes;
  tile.voxel_bytes = voxel_bytes(tile.blocks);
  bytes_ += tile.voxel_bytes;
  drop_if_empty(it);
}

void HeldMap::remove_heights(TileKey key) {
  const auto it = tiles_.find(key);
  if (it == tiles_.end() || !it->second.heights_sample) return;
  height_digests_.remove({static_cast<std::int16_t>(key.x), static_cast<std::int16_t>(key.y), 0},
                         it->second.heights_sample->crc);
  --height_tiles_;
  it->second.heights_sample.reset();
  drop_if_empty(it);
}

void HeldMap::drop_if_empty(Tiles::iterator tile) {
  if (!tile->second.bands.empty() || tile->second.heights_sample) return;
  bytes_ -= kTileBytes;
  tiles_.erase(tile);
}

const ColumnTile* HeldMap::columns(TileKey key) const {
  const auto it = tiles_.find(key);
  return it == tiles_.end() || it->second.bands.empty() ? nullptr : &it->second.columns;
}

const HeightColumns* HeldMap::heights(TileKey key) const {
  const auto it = tiles_.find(key);
  return it == tiles_.end() || !it->second.heights_sample ? nullptr : &it->second.heights;
}

}  // namespace crane
