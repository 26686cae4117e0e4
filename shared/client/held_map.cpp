#include "client/held_map.hpp"

#include <utility>

namespace crane::client {
namespace {

void erase_band(std::map<int, BlockClasses>& blocks, int band) {
  blocks.erase(blocks.lower_bound(first_block(band)), blocks.lower_bound(first_block(band + 1)));
}

}  // namespace

HeldMap::Voxels HeldMap::prepare(BandKey key, std::uint64_t revision, std::uint32_t crc,
                                 const DecodedTile& decoded) const {
  Voxels out{key, revision, crc, {}, {}};
  if (const auto it = tiles_.find(key.tile()); it != tiles_.end()) out.blocks = it->second.blocks;
  erase_band(out.blocks, key.z);
  out.blocks.insert(decoded.blocks.begin(), decoded.blocks.end());
  out.columns = columns_of(out.blocks);
  return out;
}

bool HeldMap::put(Voxels voxels) {
  HeldTile& tile = tiles_[voxels.key.tile()];
  const auto [it, fresh] = tile.bands.try_emplace(voxels.key.z);
  if (!fresh) {
    if (voxels.revision < it->second.revision) return false;
    voxel_digests_.remove(voxels.key, it->second.crc);
  }
  voxel_tiles_ += fresh ? 1 : 0;
  voxel_digests_.add(voxels.key, voxels.crc);
  it->second = {voxels.revision, voxels.crc};
  tile.blocks = std::move(voxels.blocks);
  tile.columns = std::move(voxels.columns);
  return true;
}

bool HeldMap::put(TileKey key, std::uint64_t revision, std::uint32_t crc,
                  const HeightColumns& heights) {
  HeldTile& tile = tiles_[key];
  const BandKey digest_key{static_cast<std::int16_t>(key.x), static_cast<std::int16_t>(key.y), 0};
  if (tile.heights_sample) {
    if (revision < tile.heights_sample->revision) return false;
    height_digests_.remove(digest_key, tile.heights_sample->crc);
  }
  height_tiles_ += tile.heights_sample ? 0 : 1;
  height_digests_.add(digest_key, crc);
  tile.heights_sample = Sample{revision, crc};
  tile.heights = heights;
  return true;
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
  if (tile.bands.empty() && !tile.heights_sample) tiles_.erase(it);
}

void HeldMap::remove_heights(TileKey key) {
  const auto it = tiles_.find(key);
  if (it == tiles_.end() || !it->second.heights_sample) return;
  height_digests_.remove({static_cast<std::int16_t>(key.x), static_cast<std::int16_t>(key.y), 0},
                         it->second.heights_sample->crc);
  --height_tiles_;
  it->second.heights_sample.reset();
  if (it->second.bands.empty()) tiles_.erase(it);
}

void HeldMap::put(std::uint64_t revision, std::vector<Zone> zones) {
  zones_revision_ = revision;
  zones_ = std::move(zones);
}

const ColumnTile* HeldMap::columns(TileKey key) const {
  const auto it = tiles_.find(key);
  return it == tiles_.end() || it->second.bands.empty() ? nullptr : &it->second.columns;
}

const HeightColumns* HeldMap::heights(TileKey key) const {
  const auto it = tiles_.find(key);
  return it == tiles_.end() || !it->second.heights_sample ? nullptr : &it->second.heights;
}

}  // namespace crane::client
