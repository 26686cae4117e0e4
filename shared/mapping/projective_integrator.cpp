// SPDX-License-Identifier: Apache-2.0
#include "mapping/projective_integrator.hpp"

#include <algorithm>
#include <cmath>

#include "base/threads.hpp"
#include "mapping/freeing.hpp"
#include "mapping/sighting.hpp"

namespace crane {
namespace {

static_assert(kCube == kFreeCube);
/// What comes by itself is not higher, nor than this share of the camera's height: where nothing
/// matches any more, free space below is taken back, and above it stays.
constexpr double kArrivals_m = 3, kArrivalsShare = 1.0 / 3;

/// Of its column: they come column by column, from below.
bool is_highest(const std::vector<SurfaceHit>& hits, std::size_t i) {
  return i + 1 == hits.size() || hits[i + 1].x != hits[i].x || hits[i + 1].y != hits[i].y;
}

}  // namespace

IntegrationReport ProjectiveIntegrator::integrate(const DepthFrame& frame, TimeNs time,
                                                  OccupancyMap& map) {
  IntegrationReport report;
  const double voxel_px = mean_voxel_px(frame, map.voxel_m());
  if (!(voxel_px > 0)) return report;  // no evidence
  const std::vector<SurfaceHit>* hits = nullptr;
  Frustum frustum;
  std::atomic<std::size_t> next{0};
  std::atomic<std::uint64_t> freed{0};
  const int threads = threads_or_default(settings_.threads);
  on_threads(threads, [&](int thread, Meeting& meeting) {
    if (thread == 0) {
      DepthFrame certain = frame;
      if (settings_.as_octomap) certain.sigma_disparity_px = 0;
      free_.build(certain, free_cell_px(voxel_px));
      frustum = aim(frame, map);
      meeting.announce();
    }
    if (thread == threads - 1)
      hits = &surfaces_.find(frame, map.voxel_m(), voxel_px,
                             {settings_.z_min_m, settings_.z_max_m, settings_.as_octomap},
                             report.surfaces);
    meeting.await();
    freed += carve(frustum, next, map);
  });
  report.freed = freed;
  for (Tile* tile : frustum.tiles)
    if (tile->changed) map.mark_changed(*tile);
  report.occupied = apply_all(*hits, time, map);
  return report;
}

std::uint64_t ProjectiveIntegrator::apply_all(const std::vector<SurfaceHit>& hits, TimeNs time,
                                              OccupancyMap& map) {
  struct Run {  // of hits in one tile; they come column by column
    Tile* tile;
    std::size_t begin, end;
  };
  std::vector<Run> runs;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const TileKey key{tile_of(hits[i].x), tile_of(hits[i].y)};
    if (runs.empty() || runs.back().end != i || runs.back().tile->key != key) {
      Tile* tile = map.tile_if_room(key);
      if (tile == nullptr) continue;
      runs.push_back({tile, i, i});
      map.mark_changed(*tile);
    }
    runs.back().end = i + 1;
  }
  constexpr std::size_t kWorthAThread = 5'000;  // hits
  const int threads = std::clamp(static_cast<int>(hits.size() / kWorthAThread), 1,
                                 threads_or_default(settings_.threads));
  std::atomic<std::uint64_t> occupied{0};
  on_threads(threads, [&](int thread, Meeting&) {
    std::vector<Run> mine;
    for (const Run& run : runs) {
      const auto diagonal =
          static_cast<unsigned>(run.tile->key.x) + static_cast<unsigned>(run.tile->key.y);
      if (diagonal % static_cast<unsigned>(threads) == static_cast<unsigned>(thread))
        mine.push_back(run);
    }
    std::uint64_t own = 0;
    for (std::size_t r = 0; r < mine.size(); ++r) {
      if (r + 1 < mine.size())
        fetch_ahead(hits[mine[r + 1].begin], *mine[r + 1].tile, map.voxel_m());
      for (std::size_t i = mine[r].begin; i < mine[r].end; ++i)
        own += apply(hits[i], is_highest(hits, i), time, *mine[r].tile, map) ? 1 : 0;
    }
    occupied += own;
  });
  return occupied;
}

ProjectiveIntegrator::Frustum ProjectiveIntegrator::aim(const DepthFrame& f, OccupancyMap& map) {
  Frustum out;
  const double voxel = map.voxel_m();
  const Eigen::Isometry3d T_rectified_map = f.T_map_rectified.inverse();
  Projection& p = projection_;
  p.R_exact = T_rectified_map.linear() * voxel;
  p.R = p.R_exact.cast<float>();
  p.t = T_rectified_map.translation();
  p.height_m = f.T_map_rectified.translation().z();
  for (int level = 0; level < FreeDepth::kLevels; ++level) {
    FreeProjection& c = p.levels[static_cast<std::size_t>(level)];
    c.cells = free_.cells(level);
    c.columns = free_.columns(level);
    c.rows = free_.rows(level);
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < 3; ++i) c.step[axis][i] = p.R(i, axis);
    c.focal = static_cast<float>(f.f_px / free_.cell_px(level));
    c.cu = static_cast<float>((f.cx_px + 0.5) / free_.cell_px(level));
    c.cv = static_cast<float>((f.cy_px + 0.5) / free_.cell_px(level));
    c.reach_m = 0.5F * (std::abs(p.R(2, 0)) + std::abs(p.R(2, 1)) + std::abs(p.R(2, 2)));
    c.near_m = static_cast<float>(voxel);
  }
  p.voxel_cells = static_cast<float>(f.f_px * voxel / (2 * free_.cell_px()));
  const double farthest = free_.farthest_m();
  if (!(farthest > 0)) return out;

  // Map box around the frustum: its four corners at the farthest depth, and the camera.
  Eigen::AlignedBox3d box;
  box.extend(f.T_map_rectified.translation());
  for (int corner = 0; corner < 4; ++corner) {
    const double u = (corner & 1) != 0 ? f.width : 0;
    const double v = (corner & 2) != 0 ? f.height : 0;
    box.extend(f.T_map_rectified * Eigen::Vector3d((u - f.cx_px) / f.f_px * farthest,
                                                   (v - f.cy_px) / f.f_px * farthest, farthest));
  }
  const double z_low = std::max(box.min().z(), settings_.z_min_m);
  const double z_high = std::min(box.max().z(), settings_.z_max_m);
  if (!(z_low < z_high)) return out;
  out.block_low = tile_of(map.index(z_low));
  out.block_high = tile_of(map.index(z_high));
  const int tx1 = tile_of(map.index(box.max().x()));
  const int ty1 = tile_of(map.index(box.max().y()));
  for (int ty = tile_of(map.index(box.min().y())); ty <= ty1; ++ty)
    for (int tx = tile_of(map.index(box.min().x())); tx <= tx1; ++tx)
      if (Tile* tile = map.tile_if_room({tx, ty}); tile != nullptr) out.tiles.push_back(tile);
  return out;
}

std::uint64_t ProjectiveIntegrator::carve(const Frustum& frustum, std::atomic<std::size_t>& next,
                                          OccupancyMap& map) {
  std::uint64_t freed = 0;
  for (std::size_t i = next++; i < frustum.tiles.size(); i = next++)
    for (int bz = frustum.block_low; bz <= frustum.block_high; ++bz)
      freed += carve_block(*frustum.tiles[i], bz, map);
  return freed;
}

const FreeProjection& ProjectiveIntegrator::level_at(float depth_m) const {
  // 3 x 3 cells of level 0 are 1.5 pairs: as much as a voxel of sqrt(2) pairs needs.
  constexpr float kCovered = 1.42F;
  std::size_t level = 0;
  float pairs = projection_.voxel_cells / depth_m;
  for (; pairs > kCovered && level + 1 < projection_.levels.size(); ++level) pairs /= 2;
  return projection_.levels[level];
}

bool ProjectiveIntegrator::is_free(std::int32_t x, std::int32_t y, std::int32_t z) const {
  const auto in_camera = [this](double i, double j, double k) -> Eigen::Vector3f {
    return (projection_.R_exact * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5) + projection_.t)
        .cast<float>();
  };
  // As carve_block() does for the cube of the voxel.
  constexpr int kFirst = ~(kCube - 1);
  float near = in_camera(x & kFirst, y & kFirst, z & kFirst).z();
  for (int axis = 0; axis < 3; ++axis) near += (kCube - 1) * std::min(0.0F, projection_.R(2, axis));
  const FreeProjection& c = level_at(std::max(near, projection_.levels[0].near_m));
  const Eigen::Vector3f centre = in_camera(x, y, z);
  if (centre.z() < c.near_m) return false;
  const float scale = c.focal / centre.z();
  const float u = centre.x() * scale + c.cu;
  const float v = centre.y() * scale + c.cv;
  if (!(u >= 0 && v >= 0 && u < float(c.columns) && v < float(c.rows))) return false;
  return centre.z() + c.reach_m <
         c.cells[std::size_t(int(v)) * std::size_t(c.columns) + std::size_t(int(u))];
}

void ProjectiveIntegrator::forget_blind(Tile& tile, Block& block, const Eigen::Vector3f& corner,
                                        int x0, int y0, int z0) const {
  FreeProjection blind = projection_.levels[0];
  blind.cells = free_.blind();
  std::uint8_t masks[kCube * kCube];
  free_of_cube(blind, corner.data(), masks);
  if (take_back(block, x0, y0, z0, masks)) tile.changed = tile.reclassified = true;
}

std::uint64_t ProjectiveIntegrator::carve_block(Tile& tile, int block_z, OccupancyMap& map) {
  std::uint64_t freed = 0;
  Freeing freeing(tile, map.epoch(), settings_.as_octomap);
  const Projection& p = projection_;
  const FreeProjection& cells = p.levels[0];
  const double arrivals_m = std::min(kArrivals_m, kArrivalsShare * p.height_m);
  const auto found = tile.blocks.find(block_z);
  Block* block = found == tile.blocks.end() ? nullptr : found->second.get();
  const int z_first = std::max(0, map.index(settings_.z_min_m) - block_z * kTileEdge);
  const int z_last = std::min(kTileEdge - 1, map.index(settings_.z_max_m) - block_z * kTileEdge);
  // Centre of the block's first voxel, in the camera.
  const Eigen::Vector3d first =
      p.R_exact * Eigen::Vector3d(tile.key.x * kTileEdge + 0.5, tile.key.y * kTileEdge + 0.5,
                                  block_z * kTileEdge + 0.5) +
      p.t;
  // What holds for the whole block; its cubes are rounded otherwise, a little.
  constexpr float kRounding = 0.01F, kRounding_m = 1e-3F;
  bool blind = true;
  const Eigen::Vector3f corner_of_all = first.cast<float>();
  const CubeBounds all = bounds_of_cube(cells, corner_of_all.data(), kTileEdge);
  if (all.far_m + kRounding_m < cells.near_m ||
      all.near_m - kRounding_m + cells.reach_m >= free_.farthest_m())
    return 0;
  if (all.near_m - kRounding_m >= cells.near_m) {
    constexpr float kMore = 2 * kRounding;
    const float u0 = all.u0 - kMore, v0 = all.v0 - kMore;
    const float u1 = all.u1 + kMore, v1 = all.v1 + kMore;
    if (!free_.touches(u0, v0, u1, v1)) return 0;
    const FreeDepth::Range range = free_.range(u0, v0, u1, v1);
    blind = range.blind;
    if (!blind && all.near_m - kRounding_m + cells.reach_m >= range.high) return 0;
  }
  for (int z0 = 0; z0 < kTileEdge; z0 += kCube) {
    if (z0 + kCube <= z_first || z0 > z_last) continue;
    const bool whole = z0 >= z_first && z0 + kCube - 1 <= z_last;
    for (int y0 = 0; y0 < kTileEdge; y0 += kCube)
      for (int x0 = 0; x0 < kTileEdge; x0 += kCube) {
        const std::size_t cube = cube_index(x0, y0, z0);
        const bool low = blind && (block_z * kTileEdge + z0) * map.voxel_m() < arrivals_m &&
                         !settings_.as_octomap && block != nullptr;
        const bool done = block != nullptr && block->settled[cube] == map.epoch();
        if (done && !low) continue;
        const Eigen::Vector3f corner =
            first.cast<float>() + p.R * Eigen::Vector3f(float(x0), float(y0), float(z0));
        const CubeBounds bounds = bounds_of_cube(cells, corner.data(), kCube);
        const float near = bounds.near_m, far = bounds.far_m;
        if (far < cells.near_m || near + cells.reach_m >= free_.farthest_m()) continue;
        FreeDepth::Range range;
        if (near >= cells.near_m) {
          const float u0 = bounds.u0 - kRounding, v0 = bounds.v0 - kRounding;
          const float u1 = bounds.u1 + kRounding, v1 = bounds.v1 + kRounding;
          if (!free_.touches(u0, v0, u1, v1)) continue;
          range = free_.range(u0, v0, u1, v1);
          if (low && range.blind) forget_blind(tile, *block, corner, x0, y0, z0);
          if (done && block->settled[cube] == map.epoch()) continue;
          if (near + cells.reach_m >= range.high) continue;
        }
        if (done) continue;
        if (block == nullptr && (block = map.block(tile, block_z)) == nullptr) return freed;
        const auto at = [x0](int z, int y) { return (z * kTileEdge + y) * kTileEdge + x0; };
        std::int8_t* log_odds = block->log_odds.data();
        Epoch* seen = block->seen.data();
        if (whole && far + cells.reach_m < range.low) {
          bool settled = true;
          for (int z = z0; z < z0 + kCube; ++z)
            for (int y = y0; y < y0 + kCube; ++y)
              settled &= freeing.row(log_odds + at(z, y), seen + at(z, y));
          block->settled[cube] = settled ? map.epoch() : Epoch{0};
          freed += kCube * kCube * kCube;
          continue;
        }
        std::uint8_t masks[kCube * kCube];
        free_of_cube(level_at(std::max(near, cells.near_m)), corner.data(), masks);
        bool settled = whole;
        for (int z = std::max(z0, z_first); z <= std::min(z0 + kCube - 1, z_last); ++z)
          for (int y = y0; y < y0 + kCube; ++y) {
            const unsigned mask = masks[(z - z0) * kCube + (y - y0)];
            if (mask == 0) {
              settled = settled && freeing.is_done(log_odds + at(z, y), seen + at(z, y));
              continue;
            }
            freed += static_cast<unsigned>(__builtin_popcount(mask));
            if (mask == 0xFF) {
              settled &= freeing.row(log_odds + at(z, y), seen + at(z, y));
              continue;
            }
            for (unsigned free = mask; free != 0; free &= free - 1)
              freeing.voxel(log_odds[at(z, y) + __builtin_ctz(free)],
                            seen[at(z, y) + __builtin_ctz(free)]);
            settled = settled && freeing.is_done(log_odds + at(z, y), seen + at(z, y));
          }
        if (settled) block->settled[cube] = map.epoch();
      }
  }
  return freed;
}

bool ProjectiveIntegrator::apply(const SurfaceHit& hit, bool highest, TimeNs time, Tile& tile,
                                 OccupancyMap& map) {
  const int column = in_tile(hit.y) * kTileEdge + in_tile(hit.x);
  const Sighting sighting =
      settings_.as_octomap ? Sighting{hit.z, kHit, double(hit.height_m)} : settle(hit, tile, map);
  const int z = sighting.z;
  Block* block = map.block(tile, tile_of(z));
  if (block == nullptr) return false;
  const int index = in_tile(z) * kTileColumns + column;
  std::int8_t& log_odds = block->log_odds[static_cast<std::size_t>(index)];
  // A voxel with a surface in this very frame is not free, whatever passes beside it. (One that is
  // still as occupied as can be was not freed.)
  const int most = settings_.as_octomap ? kOctomapMax : kLogOddsMax;
  const bool freed = log_odds < most && is_free(hit.x, hit.y, z);
  // New here: what was seen free below it was so before it came.
  if (log_odds <= 0 && !settings_.as_octomap) tile.reclassified |= take_back_below(tile, column, z);
  const Occupancy before = classify(log_odds);
  if (settings_.as_octomap) {
    const int v = std::min(log_odds + kHit - (freed ? kMiss : 0), most);
    log_odds = static_cast<std::int8_t>(v == 0 ? -1 : v);
  } else {
    if (freed) log_odds = static_cast<std::int8_t>(log_odds - kMiss);
    see_occupied(log_odds, sighting.strength);
  }
  tile.reclassified |= classify(log_odds) != before;
  block->seen[static_cast<std::size_t>(index)] = map.epoch();
  block->settled[cube_index(in_tile(hit.x), in_tile(hit.y), in_tile(z))] = 0;
  // Samples of a column that lie apart are a wall, or an edge.
  if (highest && !settings_.as_octomap) contradict_above(hit, z, tile, map);
  tile.moved |=
      map.observe_surface(*block, index, z, sighting.height_m, hit.r, hit.g, hit.b, sighting.share);
  saw_surface(tile.columns[static_cast<std::size_t>(column)], z, time);
  return true;
}

}  // namespace crane
