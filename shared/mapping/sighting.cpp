// SPDX-License-Identifier: Apache-2.0
#include "mapping/sighting.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "mapping/freeing.hpp"

namespace crane {
namespace {

/// A surface less certain than this share of a voxel joins one that is there, within this many
/// sigmas.
constexpr double kUncertain = 0.5, kJoin = 2;
constexpr int kJoinMax = 8;  ///< voxels
/// Below this share of certainty a sighting says less by its variance, above by its deviation.
constexpr double kVeryUncertain = 0.5;
/// Freeing reaches no nearer to a surface than so many voxels; one there is contradicted if it
/// lies so many sigmas higher.
constexpr int kJustAbove = 2;
constexpr double kContradicts = 2;

/// Voxels above and below that it may join.
int reach_of(double sigma_voxels) {
  return std::min(kJoinMax, static_cast<int>(std::ceil(kJoin * sigma_voxels)));
}

int column_of(const SurfaceHit& hit) {
  return in_tile(hit.y) * kTileEdge + in_tile(hit.x);
}

/// Log-odds of a voxel of a column; nullptr: no block there.
std::int8_t* log_odds_at(Tile& tile, int column, int z) {
  const auto block = tile.blocks.find(tile_of(z));
  if (block == tile.blocks.end()) return nullptr;
  return &block->second->log_odds[std::size_t(in_tile(z) * kTileColumns + column)];
}

/// The voxel that is believed most, within `reach` of `z`; nothing seen: none.
std::optional<int> joined(Tile& tile, int column, int z, int reach) {
  std::optional<int> out;
  int best = 0;
  for (int from = z - reach, to = 0; from <= z + reach; from = to) {  // block by block
    to = std::min((tile_of(from) + 1) * kTileEdge, z + reach + 1);
    const std::int8_t* there = log_odds_at(tile, column, from);
    if (there == nullptr) continue;
    for (int k = from; k < to; ++k, there += kTileColumns)
      if (*there > best) best = *there, out = k;
  }
  return out;
}

/// All that is known of the surface in voxel `from` goes to voxel `to` of the column, if there is
/// memory for it; a certain surface there stays.
bool move(Tile& tile, int column, int from, int to, OccupancyMap& map) {
  Block* const target = map.block(tile, tile_of(to));
  if (target == nullptr) return false;
  auto* const surfaces = map.layer(*target, std::size_t(in_tile(to)));
  if (surfaces == nullptr) return false;
  Block& source = *tile.blocks.at(tile_of(from));
  Surface& before = (*source.surface[std::size_t(in_tile(from))])[std::size_t(column)];
  Surface& there = (*surfaces)[std::size_t(column)];
  const int index = in_tile(to) * kTileColumns + column;
  std::int8_t& now = target->log_odds[std::size_t(index)];
  std::int8_t& old = source.log_odds[std::size_t(in_tile(from) * kTileColumns + column)];
  if (now <= 0 || there.certain == 0) there = before;
  before = {};
  now = std::max(now, old);
  old = 0;
  target->seen[std::size_t(index)] = map.epoch();
  target->settled[cube_index(column % kTileEdge, column / kTileEdge, in_tile(to))] = 0;
  tile.reclassified = true;
  return true;
}

}  // namespace

Sighting settle(const SurfaceHit& hit, Tile& tile, OccupancyMap& map) {
  const double height_m = double(hit.height_m);
  const double sigma_voxels = double(hit.sigma_m) / map.voxel_m();
  Sighting out{hit.z, kHit, height_m, OccupancyMap::kAlike};
  if (sigma_voxels <= kUncertain) return out;
  const double certainty = kUncertain / sigma_voxels;
  const double says = kHit * certainty * std::min(1.0, certainty / kVeryUncertain);
  out.strength = std::max(1, static_cast<int>(says));
  out.share = 1;
  const int reach = reach_of(sigma_voxels);
  const int column = column_of(hit);
  const std::optional<int> at = joined(tile, column, hit.z, reach);
  if (!at) return out;
  out.z = *at;
  const Block& block = *tile.blocks.at(tile_of(*at));
  const int index = in_tile(*at) * kTileColumns + column;
  const auto& layer = block.surface[std::size_t(in_tile(*at))];
  if (!layer) return out;
  const Surface& surface = (*layer)[std::size_t(column)];
  // Log-odds are the sum of what sightings said.
  const int known = block.log_odds[std::size_t(index)];
  if (surface.certain != 0) {
    out.share = 0;
    return out;
  }
  out.share = double(out.strength) / (known + out.strength);
  const double before_m = map.surface_height_m(block, index, *at);
  const double mean_m = before_m + out.share * (height_m - before_m);
  const int to = map.index(mean_m);
  if (to == *at || !move(tile, column, *at, to, map)) return out;
  out.z = to;
  out.height_m = mean_m;
  out.share = 1;
  return out;
}

void fetch_ahead(const SurfaceHit& hit, const Tile& tile, double voxel_m) {
  constexpr std::size_t kLine = 64;
  const auto fetch = [](const void* from, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; i += kLine)
      __builtin_prefetch(static_cast<const char*>(from) + i, 1);
  };
  const auto row = std::size_t(in_tile(hit.y)) * kTileEdge;
  fetch(&tile.columns[row], kTileEdge * sizeof(Column));
  const int reach = reach_of(double(hit.sigma_m) / voxel_m);
  for (int from = hit.z - reach, to = 0; from <= hit.z + reach; from = to) {  // block by block
    to = std::min((tile_of(from) + 1) * kTileEdge, hit.z + reach + 1);
    const auto block = tile.blocks.find(tile_of(from));
    if (block == tile.blocks.end()) continue;
    for (int k = from; k < to; ++k)
      fetch(&block->second->log_odds[std::size_t(in_tile(k)) * kTileColumns + row], 1);
    if (hit.z < from || hit.z >= to) continue;
    const auto z = std::size_t(in_tile(hit.z));
    fetch(&block->second->seen[z * kTileColumns + row], 1);
    if (const auto& layer = block->second->surface[z])
      fetch(&(*layer)[row], kTileEdge * sizeof(Surface));
  }
}

void contradict_above(const SurfaceHit& hit, int z, Tile& tile, OccupancyMap& map) {
  for (int k = z + 1; k <= z + kJustAbove; ++k) {
    if (k * map.voxel_m() - double(hit.height_m) < kContradicts * double(hit.sigma_m)) continue;
    std::int8_t* above = log_odds_at(tile, column_of(hit), k);
    if (above == nullptr || *above <= 0) continue;
    const Occupancy before = classify(*above);
    *above = static_cast<std::int8_t>(std::max(0, *above + kMiss));
    tile.reclassified |= classify(*above) != before;
  }
}

}  // namespace crane
