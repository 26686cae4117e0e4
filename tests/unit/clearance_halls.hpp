// SPDX-License-Identifier: Apache-2.0
#pragma once

// Halls to ask clearance in, seeded or by hand, and the slow reference: voxel by voxel.

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "client/clearance_check.hpp"
#include "client/swept_area.hpp"

namespace crane::client {

inline constexpr double kVoxel = 0.1;

/// A map that can be asked both ways: as decoded tiles, slowly, and as columns.
struct TestMap {
  std::map<TileKey, DecodedTile> tiles;
  std::map<TileKey, ColumnTile> columns;
  std::map<TileKey, HeightColumns> heights;

  void set(int x, int y, int z, Occupancy class_) {
    auto& byte = tiles[{tile_of(x), tile_of(y)}].blocks[tile_of(z)][std::size_t(
        ((in_tile(z) * 32 + in_tile(y)) * 32 + in_tile(x)) / 4)];
    const int shift = 2 * (in_tile(x) % 4);
    byte = static_cast<std::uint8_t>((byte & ~(3 << shift)) | int(class_) << shift);
  }
  [[nodiscard]] Occupancy at(int x, int y, int z) const {
    const auto it = tiles.find({tile_of(x), tile_of(y)});
    return it == tiles.end() ? Occupancy::kUnknown : it->second.at(in_tile(x), in_tile(y), z);
  }
  void finish(TimeNs seen) {
    for (const auto& [key, tile] : tiles) {
      columns[key] = columns_of(tile.blocks);
      HeightColumns& h = heights[key];
      for (std::size_t i = 0; i < h.columns.size(); ++i)  // not all at once
        h.columns[i].last_observed = seen + TimeNs(i * 7919 % 3001) * 1'000'000;
      h.sum_up();
    }
  }
  [[nodiscard]] ColumnView view() const {
    return {kVoxel,
            [this](TileKey key) {
              const auto it = columns.find(key);
              return it == columns.end() ? nullptr : &it->second;
            },
            [this](TileKey key) {
              const auto it = heights.find(key);
              return it == heights.end() ? nullptr : &it->second;
            }};
  }
};

/// Floor, free space up to 4 m, boxes, and patches that nobody saw; -4..6 m.
inline TestMap random_hall(std::mt19937& random, bool with_gaps) {
  TestMap map;
  for (int x = -40; x < 60; ++x)
    for (int y = -40; y < 60; ++y) {
      map.set(x, y, 0, Occupancy::kOccupied);
      for (int z = 1; z < 40; ++z) map.set(x, y, z, Occupancy::kFree);
    }
  const auto whole = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  for (int i = 0; i < 6; ++i) {
    const int x0 = whole(-40, 50), y0 = whole(-40, 50), top = whole(3, 25);
    const bool unknown = with_gaps && i % 3 == 2;
    for (int x = x0; x < std::min(60, x0 + whole(2, 9)); ++x)
      for (int y = y0; y < std::min(60, y0 + 6); ++y)
        for (int z = unknown ? whole(1, 20) : 1; z < top; ++z)
          map.set(x, y, z, unknown ? Occupancy::kUnknown : Occupancy::kOccupied);
  }
  map.finish(1000 * kNsPerSecond);
  return map;
}

inline ClearanceQuery random_query(std::mt19937& random) {
  const auto real = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  ClearanceQuery q;
  const int poses = 1 + static_cast<int>(random() % 3);
  for (int i = 0; i < poses; ++i)
    q.path.push_back({real(-2.5, 4.5), real(-2.5, 4.5), real(0.4, 2.6), real(-2, 2)});
  if (random() % 2 == 0)
    for (Pose& p : q.path) p.yaw_rad = q.path[0].yaw_rad, p.z_m = q.path[0].z_m;
  q.load = {real(0, 1.2), real(0, 0.8), real(0, 0.8), real(0, 0.3)};
  q.margins = {real(0, 0.2), real(0, 0.2), real(0, 0.1), random() % 2 == 0 ? real(0, 0.5) : 0};
  q.now_ns = 1010 * kNsPerSecond;
  return q;
}

/// Separating axes of a convex polygon and a cell.
inline bool touches(const std::vector<Corner>& hull, double x0, double y0, double cell) {
  const Corner square[4] = {{x0, y0}, {x0 + cell, y0}, {x0 + cell, y0 + cell}, {x0, y0 + cell}};
  const auto apart = [&](double nx, double ny) {
    double a0 = 1e300, a1 = -1e300, b0 = 1e300, b1 = -1e300;
    for (const Corner& c : hull)
      a0 = std::min(a0, nx * c.x + ny * c.y), a1 = std::max(a1, nx * c.x + ny * c.y);
    for (const Corner& c : square)
      b0 = std::min(b0, nx * c.x + ny * c.y), b1 = std::max(b1, nx * c.x + ny * c.y);
    return a1 < b0 || b1 < a0;
  };
  if (apart(1, 0) || apart(0, 1)) return false;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Corner& a = hull[i];
    const Corner& b = hull[(i + 1) % hull.size()];
    if (apart(b.y - a.y, a.x - b.x)) return false;
  }
  return true;
}

/// Whether all voxels over the cells that touch a polygon are free, one by one.
inline bool all_free(const TestMap& map, const std::vector<Corner>& hull, double low_m,
                     double high_m, std::uint64_t* columns = nullptr, TimeNs* oldest = nullptr) {
  bool free = true;
  double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;
  for (const Corner& c : hull) {
    x0 = std::min(x0, c.x), x1 = std::max(x1, c.x);
    y0 = std::min(y0, c.y), y1 = std::max(y1, c.y);
  }
  const auto index = [](double v) { return static_cast<int>(std::floor(v / kVoxel)); };
  for (int x = index(x0) - 1; x <= index(x1) + 1; ++x)
    for (int y = index(y0) - 1; y <= index(y1) + 1; ++y) {
      if (!touches(hull, x * kVoxel, y * kVoxel, kVoxel)) continue;
      if (columns != nullptr) ++*columns;
      if (oldest != nullptr)
        *oldest = std::min(*oldest, map.heights.at({tile_of(x), tile_of(y)})
                                        .columns[std::size_t(in_tile(y) * 32 + in_tile(x))]
                                        .last_observed);
      for (int z = static_cast<int>(std::floor(low_m / kVoxel));
           z < static_cast<int>(std::ceil(high_m / kVoxel)); ++z)
        free &= map.at(x, y, z) == Occupancy::kFree;
    }
  return free;
}

/// The load at one pose, `more` larger on all sides.
inline bool pose_is_free(const TestMap& map, const ClearanceQuery& q, const Pose& p, double more) {
  const double margin = q.margins.horizontal_m + q.margins.sway_m + more;
  const double hx = q.load.size_x_m / 2 + margin, hy = q.load.size_y_m / 2 + margin;
  const double c = std::cos(p.yaw_rad), s = std::sin(p.yaw_rad);
  std::vector<Corner> box;
  for (const auto& [x, y] : {std::pair{-hx, -hy}, {hx, -hy}, {hx, hy}, {-hx, hy}})
    box.push_back({p.x_m + c * x - s * y, p.y_m + s * x + c * y});
  return all_free(map, box, p.z_m - q.margins.vertical_m - 2 * more,
                  p.z_m + q.load.size_z_m + q.load.above_m + q.margins.vertical_m + 2 * more);
}

inline ClearanceQuery over_the_hall(double z_m) {
  ClearanceQuery q;
  q.path = {{-2, 0.05, z_m, 0}, {4, 0.05, z_m, 0}};
  q.load = {1, 1, 0.5, 0};
  q.margins = {0.1, 0.1, 0, 0};
  q.now_ns = 1010 * kNsPerSecond;
  return q;
}

inline TestMap hall_with_a_box() {
  TestMap map;
  for (int x = -40; x < 60; ++x)
    for (int y = -40; y < 60; ++y) {
      map.set(x, y, 0, Occupancy::kOccupied);
      for (int z = 1; z < 40; ++z) map.set(x, y, z, Occupancy::kFree);
    }
  for (int x = 20; x < 25; ++x)
    for (int y = -3; y < 3; ++y)
      for (int z = 1; z <= 11; ++z) map.set(x, y, z, Occupancy::kOccupied);
  map.finish(1000 * kNsPerSecond);
  return map;
}

/// A random hall in which things hang as well, and zones.
struct HallWithAll {
  TestMap map;
  std::vector<Zone> zones;
  double ceiling_m = 4;
  [[nodiscard]] ColumnView view() const {
    ColumnView view = map.view();
    view.zones = &zones;
    view.ceiling_m = ceiling_m;
    return view;
  }
};

/// A star-shaped polygon, convex or not.
inline Zone random_zone(std::mt19937& random) {
  const auto real = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Zone zone;
  zone.id = static_cast<std::uint32_t>(1 + random() % 100);
  zone.active = true;
  zone.kind = random() % 3 == 0 ? Zone::Kind::kSlowDown : Zone::Kind::kNoGo;
  zone.z_min_m = real(-1, 2);
  zone.z_max_m = zone.z_min_m + real(0.1, 2);
  const double x = real(-3, 5), y = real(-3, 5);
  const int corners = 3 + static_cast<int>(random() % 6);
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * 3.14159265 * (i + real(0, 0.8)) / corners, r = real(0.1, 1.2);
    zone.corners.push_back({x + r * std::cos(angle), y + r * std::sin(angle)});
  }
  return zone;
}

inline HallWithAll random_hall_with_all(std::mt19937& random) {
  HallWithAll hall{random_hall(random, random() % 2 == 0), {}, 4};
  for (int i = 0; i < 3; ++i) {  // beams and lamps, known or not
    const int x0 = static_cast<int>(random() % 90) - 40, y0 = static_cast<int>(random() % 90) - 40;
    const int z = 20 + static_cast<int>(random() % 19);
    const bool along_x = random() % 2 == 0;
    const auto is = random() % 3 == 0 ? Occupancy::kUnknown : Occupancy::kOccupied;
    for (int k = 0; k < 40; ++k) {
      const int x = std::min(59, along_x ? x0 + k : x0), y = std::min(59, along_x ? y0 : y0 + k);
      hall.map.set(x, y, z, is);
    }
  }
  hall.map.finish(1000 * kNsPerSecond);
  for (unsigned i = 0; i < random() % 4; ++i) hall.zones.push_back(random_zone(random));
  if (random() % 2 == 0) hall.ceiling_m = 2.5 + double(random() % 15) / 10;
  return hall;
}

inline ClearanceQuery random_query_of_any_height(std::mt19937& random) {
  ClearanceQuery q = random_query(random);
  if (random() % 2 == 0) q.load.above_m = kToRopeTop;
  if (random() % 4 == 0) q.path[0].z_m = double(random() % 60) / 10;
  return q;
}

/// The path, flown level.
inline ClearanceQuery flat(ClearanceQuery q, double z_m) {
  for (Pose& p : q.path) p.z_m = z_m;
  return q;
}

}  // namespace crane::client
