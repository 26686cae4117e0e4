// SPDX-License-Identifier: Apache-2.0
#include "mapping/occupancy_map.hpp"

#include <algorithm>
#include <utility>

#include "base/expects.hpp"

namespace crane {

bool OccupancyMap::reserve(std::size_t bytes) {
  std::size_t now = bytes_;
  do {
    if (bytes > max_bytes_ - std::min(now, max_bytes_)) {
      ++refused_;
      return false;
    }
  } while (!bytes_.compare_exchange_weak(now, now + bytes));
  return true;
}

Tile* OccupancyMap::tile_if_room(TileKey key) {
  if (const auto it = tiles_.find(key); it != tiles_.end()) return it->second.get();
  if (!reserve(sizeof(Tile))) return nullptr;
  auto made = std::make_unique<Tile>();
  made->key = key;
  return (tiles_[key] = std::move(made)).get();
}

Tile& OccupancyMap::tile(TileKey key) {
  Tile* tile = tile_if_room(key);
  expects(tile != nullptr, "there is room for the tile");
  return *tile;
}

const Tile* OccupancyMap::find(TileKey key) const {
  const auto it = tiles_.find(key);
  return it == tiles_.end() ? nullptr : it->second.get();
}

Block* OccupancyMap::block(Tile& tile, int block_z) {
  const auto it = tile.blocks.find(block_z);
  if (it != tile.blocks.end()) return it->second.get();
  if (!reserve(sizeof(Block))) return nullptr;
  return (tile.blocks[block_z] = std::make_unique<Block>()).get();
}

std::array<Surface, kTileColumns>* OccupancyMap::layer(Block& block, std::size_t z) {
  auto& surfaces = block.surface[z];
  if (!surfaces && reserve(sizeof *surfaces))
    surfaces = std::make_unique<std::array<Surface, kTileColumns>>();
  return surfaces.get();
}

Occupancy OccupancyMap::at(int x, int y, int z) const {
  const Tile* t = find({tile_of(x), tile_of(y)});
  if (t == nullptr) return Occupancy::kUnknown;
  const auto it = t->blocks.find(tile_of(z));
  if (it == t->blocks.end()) return Occupancy::kUnknown;
  return it->second->at((in_tile(z) * kTileEdge + in_tile(y)) * kTileEdge + in_tile(x));
}

std::vector<const Tile*> OccupancyMap::tiles() const {
  std::vector<const Tile*> out;
  out.reserve(tiles_.size());
  for (const auto& [key, tile] : tiles_) out.push_back(tile.get());
  std::sort(out.begin(), out.end(), [](auto* a, auto* b) { return a->key < b->key; });
  return out;
}

std::vector<TileKey> OccupancyMap::tile_keys() const {
  std::vector<TileKey> out;
  out.reserve(tiles_.size());
  for (const auto& [key, tile] : tiles_) out.push_back(key);
  return out;
}

std::vector<Tile*> OccupancyMap::changed_tiles() {
  std::erase_if(changed_, [](Tile* tile) {
    tile->listed = tile->changed;
    return !tile->changed;
  });
  std::sort(changed_.begin(), changed_.end(), [](auto* a, auto* b) { return a->key < b->key; });
  return changed_;
}

void OccupancyMap::mark_changed(Tile& tile) {
  tile.changed = true;
  if (!std::exchange(tile.listed, true)) changed_.push_back(&tile);
}

bool OccupancyMap::observe_surface(Block& block, int index, int voxel_z, double height_m,
                                   std::uint8_t r, std::uint8_t g, std::uint8_t b, double share) {
  auto* const surfaces = layer(block, static_cast<std::size_t>(index / kTileColumns));
  if (surfaces == nullptr) return false;
  Surface& s = (*surfaces)[static_cast<std::size_t>(index % kTileColumns)];
  const double offset = 127 * (height_m - centre(voxel_z)) / (0.5 * voxel_m_);
  // A running mean over at most 32 observations: older ones fade. The first certain one begins it
  // anew.
  const int n = std::min<int>(s.weight, 31);
  const int before = s.offset;
  if (share == kAlike) {
    share = s.certain != 0 ? 1.0 / (n + 1) : 1;
    s.certain = 1;
  }
  if (n == 0) share = 1;
  s.offset = static_cast<std::int8_t>(
      std::floor(std::clamp(before + share * (offset - before), -127.0, 127.0) + 0.5));
  const auto blend = [n](int old, int now) {
    return static_cast<std::uint8_t>((old * n + now + (n + 1) / 2) / (n + 1));
  };
  s.r = blend(s.r, r);
  s.g = blend(s.g, g);
  s.b = blend(s.b, b);
  s.weight = static_cast<std::uint8_t>((n + 1) & 0x7F);
  return n == 0 || std::abs(s.offset - before) * voxel_m_ / 254 > 1e-3;
}

double OccupancyMap::surface_height_m(const Block& block, int index, int voxel_z) const {
  const auto& layer = block.surface[static_cast<std::size_t>(index / kTileColumns)];
  if (!layer) return centre(voxel_z);
  const Surface& s = (*layer)[static_cast<std::size_t>(index % kTileColumns)];
  return centre(voxel_z) + 0.5 * voxel_m_ * s.offset / 127.0;
}

PointCloud OccupancyMap::occupied_points() const {
  PointCloud cloud;
  for (const Tile* tile : tiles())
    for (const auto& [bz, block] : tile->blocks)
      for (int i = 0; i < kBlockVoxels; ++i) {
        if (block->at(i) != Occupancy::kOccupied) continue;
        const int x = tile->key.x * kTileEdge + i % kTileEdge;
        const int y = tile->key.y * kTileEdge + i / kTileEdge % kTileEdge;
        const int z = bz * kTileEdge + i / kTileColumns;
        Point p{float(centre(x)),
                float(centre(y)),
                float(surface_height_m(*block, i, z)),
                128,
                128,
                128};
        if (const auto& layer = block->surface[static_cast<std::size_t>(i / kTileColumns)]) {
          const Surface& s = (*layer)[static_cast<std::size_t>(i % kTileColumns)];
          if (s.weight > 0) p.r = s.r, p.g = s.g, p.b = s.b;
        }
        cloud.push_back(p);
      }
  return cloud;
}

}  // namespace crane
