// SPDX-License-Identifier: Apache-2.0
#include "evaluation/judged_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "mapping/heights.hpp"

namespace crane {
namespace {

constexpr double kAround = 1;                ///< [m] beside the truth
constexpr double kBelow = 2, kAbove = 60;    ///< [m] of it
constexpr std::size_t kMaxBlocks = 100'000;  ///< of 8 KiB
constexpr int kNone = std::numeric_limits<int>::min();

void set(BlockClasses& block, int index, Occupancy occupancy) {
  std::uint8_t& byte = block[static_cast<std::size_t>(index / 4)];
  const int shift = 2 * (index % 4);
  byte = static_cast<std::uint8_t>((byte & ~(3 << shift)) | int(occupancy) << shift);
}

/// Voxels first .. last on each axis that a cube fills, within the limits.
struct Range {
  std::array<int, 3> first{}, last{};
  [[nodiscard]] bool empty() const {
    return first[0] > last[0] || first[1] > last[1] || first[2] > last[2];
  }
};

Range range_of(const MapCube& cube, double voxel, const Range& limits) {
  Range out;
  const std::array<double, 3> centre = {cube.x_m, cube.y_m, cube.z_m};
  for (std::size_t a = 0; a < 3; ++a) {
    const double low = std::round((centre[a] - cube.size_m / 2) / voxel);
    const double high = std::round((centre[a] + cube.size_m / 2) / voxel) - 1;
    out.first[a] = int(std::clamp(low, double(limits.first[a]), double(limits.last[a]) + 1));
    out.last[a] = int(std::clamp(high, double(limits.first[a]) - 1, double(limits.last[a])));
  }
  return out;
}

/// Calls fn(tile, block height index, part of the range within that block).
template <class Fn>
void for_each_block(const Range& r, Fn fn) {
  for (int ty = tile_of(r.first[1]); ty <= tile_of(r.last[1]); ++ty)
    for (int tx = tile_of(r.first[0]); tx <= tile_of(r.last[0]); ++tx)
      for (int bz = tile_of(r.first[2]); bz <= tile_of(r.last[2]); ++bz) {
        Range part = r;
        const std::array<int, 3> block = {tx, ty, bz};
        for (std::size_t a = 0; a < 3; ++a) {
          part.first[a] = std::max(r.first[a], block[a] * kTileEdge);
          part.last[a] = std::min(r.last[a], block[a] * kTileEdge + kTileEdge - 1);
        }
        fn(TileKey{tx, ty}, bz, part);
      }
}

}  // namespace

Result<JudgedMap> JudgedMap::from_file(const OctomapFile& file, const HeightMap& truth) {
  const double voxel = file.voxel_m;
  JudgedMap out(voxel);
  Range limits;
  const std::array<double, 3> low = {truth.origin_x_m - kAround, truth.origin_y_m - kAround,
                                     truth.offset_m - kBelow};
  const std::array<double, 3> high = {truth.origin_x_m + truth.columns * truth.cell_m + kAround,
                                      truth.origin_y_m + truth.rows * truth.cell_m + kAround,
                                      truth.offset_m + kAbove};
  for (std::size_t a = 0; a < 3; ++a) {
    limits.first[a] = out.index(low[a]);
    limits.last[a] = out.index(high[a]);
  }
  Blocks blocks;
  std::size_t count = 0;
  for (const bool occupied : {false, true})
    for (const MapCube& cube : occupied ? file.occupied : file.free) {
      const Range range = range_of(cube, voxel, limits);
      if (range.empty()) continue;
      double needed = 1;
      for (std::size_t a = 0; a < 3; ++a)
        needed *= tile_of(range.last[a]) - tile_of(range.first[a]) + 1;
      if (needed > double(kMaxBlocks)) count = kMaxBlocks + 1;
      if (count <= kMaxBlocks)
        for_each_block(range, [&](TileKey key, int bz, const Range& part) {
          const auto [at, made] = blocks[key].try_emplace(bz);
          count += made ? 1 : 0;
          for (int z = part.first[2]; z <= part.last[2]; ++z)
            for (int y = part.first[1]; y <= part.last[1]; ++y)
              for (int x = part.first[0]; x <= part.last[0]; ++x)
                set(at->second, (in_tile(z) * kTileEdge + in_tile(y)) * kTileEdge + in_tile(x),
                    occupied ? Occupancy::kOccupied : Occupancy::kFree);
        });
      if (count > kMaxBlocks)
        return Error{ErrorCode::kBadData, "map",
                     "voxels of " + std::to_string(voxel) + " m are too fine for a truth so large",
                     "judge a smaller part"};
    }
  out.occupied_ = file.occupied;
  out.hold(blocks);
  return out;
}

JudgedMap JudgedMap::from_map(const OccupancyMap& map) {
  JudgedMap out(map.voxel_m());
  out.with_heights_ = true;
  Blocks blocks;
  for (const Tile* tile : map.tiles())
    for (const auto& [bz, block] : tile->blocks) {
      BlockClasses& classes = blocks[tile->key][bz];
      for (int i = 0; i < kBlockVoxels; ++i) {
        const Occupancy what = block->at(i);
        if (what == Occupancy::kUnknown) continue;
        set(classes, i, what);
        if (what == Occupancy::kOccupied)
          out.occupied_.push_back({map.centre(tile->key.x * kTileEdge + i % kTileEdge),
                                   map.centre(tile->key.y * kTileEdge + i / kTileEdge % kTileEdge),
                                   map.centre(bz * kTileEdge + i / kTileColumns), map.voxel_m()});
      }
    }
  out.hold(blocks);
  for (const Tile* tile : map.tiles()) {
    HeightColumns& heights = out.tiles_[tile->key].heights;
    heights.columns = tile_heights(map, *tile, floor_tolerance_m(map.voxel_m()));
    heights.sum_up();
  }
  return out;
}

void JudgedMap::hold(const Blocks& blocks) {
  for (const auto& [key, of_tile] : blocks) {
    HeldTile& tile = tiles_[key];
    tile.voxels = columns_of(of_tile);
    tile.top.assign(kTileColumns, kNone);
    for (int w = 0; w < tile.voxels.words; ++w)
      for (int c = 0; c < kTileColumns; ++c)
        if (const std::uint64_t bits =
                tile.voxels.occupied[static_cast<std::size_t>(w * kTileColumns + c)];
            bits != 0)
          tile.top[static_cast<std::size_t>(c)] =
              tile.voxels.z0 + 64 * w + 63 - __builtin_clzll(bits);
  }
}

const JudgedMap::HeldTile* JudgedMap::find(int x, int y) const {
  const auto at = tiles_.find({tile_of(x), tile_of(y)});
  return at == tiles_.end() ? nullptr : &at->second;
}

Occupancy JudgedMap::at(int x, int y, int z) const {
  const HeldTile* tile = find(x, y);
  if (tile == nullptr) return Occupancy::kUnknown;
  const int column = in_tile(y) * kTileEdge + in_tile(x);
  return tile->voxels.is_occupied(column, z) ? Occupancy::kOccupied
         : tile->voxels.is_free(column, z)   ? Occupancy::kFree
                                             : Occupancy::kUnknown;
}

double JudgedMap::top_m(int x, int y) const {
  const HeldTile* tile = find(x, y);
  const int top = tile == nullptr || tile->top.empty()
                      ? kNone
                      : tile->top[static_cast<std::size_t>(in_tile(y) * kTileEdge + in_tile(x))];
  return top == kNone ? -std::numeric_limits<double>::infinity() : (top + 1) * voxel_m_;
}

client::ColumnView JudgedMap::view() const {
  client::ColumnView view;
  view.voxel_m = voxel_m_;
  view.voxels = [this](TileKey key) -> const ColumnTile* {
    const auto at = tiles_.find(key);
    return at == tiles_.end() ? nullptr : &at->second.voxels;
  };
  view.heights = [this](TileKey key) -> const HeightColumns* {
    const auto at = tiles_.find(key);
    return at == tiles_.end() || !with_heights_ ? nullptr : &at->second.heights;
  };
  return view;
}

}  // namespace crane
