#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "client/clearance_check.hpp"
#include "client/swept_area.hpp"
#include "client/voxel_map.hpp"
#include "client/zone_check.hpp"

namespace crane::client {
namespace {

constexpr double kVoxel = 0.1;

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
TestMap random_hall(std::mt19937& random, bool with_gaps) {
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

ClearanceQuery random_query(std::mt19937& random) {
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
bool touches(const std::vector<Corner>& hull, double x0, double y0, double cell) {
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
bool all_free(const TestMap& map, const std::vector<Corner>& hull, double low_m, double high_m,
              std::uint64_t* columns = nullptr, TimeNs* oldest = nullptr) {
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
bool pose_is_free(const TestMap& map, const ClearanceQuery& q, const Pose& p, double more) {
  const double margin = q.margins.horizontal_m + q.margins.sway_m + more;
  const double hx = q.load.size_x_m / 2 + margin, hy = q.load.size_y_m / 2 + margin;
  const double c = std::cos(p.yaw_rad), s = std::sin(p.yaw_rad);
  std::vector<Corner> box;
  for (const auto& [x, y] : {std::pair{-hx, -hy}, {hx, -hy}, {hx, hy}, {-hx, hy}})
    box.push_back({p.x_m + c * x - s * y, p.y_m + s * x + c * y});
  return all_free(map, box, p.z_m - q.margins.vertical_m - 2 * more,
                  p.z_m + q.load.size_z_m + q.load.above_m + q.margins.vertical_m + 2 * more);
}

TEST(Clearance, EqualsASlowReferenceVoxelByVoxel) {
  std::mt19937 random(11);
  int clear = 0;
  for (int hall = 0; hall < 20; ++hall) {
    const TestMap map = random_hall(random, hall % 2 == 1);
    for (int i = 0; i < 100; ++i) {
      const ClearanceQuery q = random_query(random);
      const Clearance answer = check_clearance(q, map.view(), q.now_ns);
      bool free = true;
      std::uint64_t columns = 0;
      TimeNs oldest = q.now_ns;
      for (const SweptPiece& piece : sweep(q, kVoxel))
        free &= all_free(map, piece.hull, piece.low_m, piece.high_m, &columns, &oldest);
      ASSERT_EQ(answer.verdict, free ? Verdict::kClear : Verdict::kBlocked) << hall << " " << i;
      ASSERT_EQ(answer.columns, columns);
      ASSERT_NEAR(answer.oldest_age_s, double(q.now_ns - oldest) * 1e-9, 1e-6);
      clear += free ? 1 : 0;
      if (free) continue;
      const int x = static_cast<int>(std::floor(answer.first_x_m / kVoxel));
      const int y = static_cast<int>(std::floor(answer.first_y_m / kVoxel));
      const int z = static_cast<int>(std::floor(answer.first_z_m / kVoxel));
      EXPECT_NE(map.at(x, y, z), Occupancy::kFree);
    }
  }
  EXPECT_GT(clear, 200);
  EXPECT_LT(clear, 1800);
}

TEST(Clearance, IsNeverClearWhereADenselySampledLoadIsNotAndHardlyLarger) {
  std::mt19937 random(12);
  int clear = 0;
  for (int hall = 0; hall < 10; ++hall) {
    const TestMap map = random_hall(random, hall % 2 == 1);
    for (int i = 0; i < 12; ++i) {
      const ClearanceQuery q = random_query(random);
      const bool says_clear = check_clearance(q, map.view(), q.now_ns).verdict == Verdict::kClear;
      bool free = true;
      bool larger_free = true;
      const auto at = [&](const Pose& p) {
        free = free && pose_is_free(map, q, p, 0);
        larger_free = larger_free && pose_is_free(map, q, p, kVoxel);
      };
      at(q.path[0]);
      for (std::size_t leg = 0; leg + 1 < q.path.size(); ++leg) {
        const Pose& a = q.path[leg];
        const Pose& b = q.path[leg + 1];
        const double length = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
        const double whole = 1 + (length > 0 ? q.margins.braking_m / length : 0);
        for (double t = 0; t <= whole; t += 0.02 / std::max(0.5, length)) {
          Pose p{a.x_m + t * (b.x_m - a.x_m), a.y_m + t * (b.y_m - a.y_m), b.z_m, b.yaw_rad};
          if (t < 1) {
            p.z_m = a.z_m + t * (b.z_m - a.z_m);
            p.yaw_rad = a.yaw_rad + t * (b.yaw_rad - a.yaw_rad);
          }
          at(p);
        }
      }
      if (says_clear)
        EXPECT_TRUE(free) << hall << " " << i;
      else
        EXPECT_FALSE(larger_free) << hall << " " << i;
      clear += says_clear ? 1 : 0;
    }
  }
  EXPECT_GT(clear, 10);
}

ClearanceQuery over_the_hall(double z_m) {
  ClearanceQuery q;
  q.path = {{-2, 0.05, z_m, 0}, {4, 0.05, z_m, 0}};
  q.load = {1, 1, 0.5, 0};
  q.margins = {0.1, 0.1, 0, 0};
  q.now_ns = 1010 * kNsPerSecond;
  return q;
}

TestMap hall_with_a_box() {
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

TEST(Clearance, NamesTheFirstObstacleAndTheHeightThatIsSafe) {
  const TestMap map = hall_with_a_box();
  const Clearance low = check_clearance(over_the_hall(0.6), map.view(), 1010 * kNsPerSecond);
  EXPECT_EQ(low.verdict, Verdict::kBlocked);
  EXPECT_EQ(low.reason, Reason::kObstacle);
  EXPECT_NEAR(low.first_x_m, 2.05, 1e-9);
  EXPECT_NEAR(low.safe_height_m, 1.3, 1e-9);  // top of the box 1.2 m, margin 0.1 m
  EXPECT_EQ(low.safe_low_m, low.safe_height_m);
  EXPECT_NEAR(low.safe_high_m, 4 - 0.5 - 0.1, 1e-9);  // nothing is known above 4 m
  EXPECT_NEAR(low.oldest_age_s, 10, 1e-9);
  EXPECT_EQ(low.unknown_fraction, 0);
  EXPECT_EQ(
      check_clearance(over_the_hall(low.safe_height_m), map.view(), 1010 * kNsPerSecond).verdict,
      Verdict::kClear);
  // The heights say that the box ends at 1.13 m.
  TestMap finer = hall_with_a_box();
  for (auto& [key, tile] : finer.heights)
    for (int i = 0; i < kTileColumns; ++i) {
      const int x = key.x * 32 + i % 32, y = key.y * 32 + i / 32;
      if (x >= 20 && x < 25 && y >= -3 && y < 3)
        tile.columns[std::size_t(i)] = {1.13, 0.01, ColumnState::kObstacle, 1000 * kNsPerSecond};
    }
  // Half a voxel over it, so that what the surface has of height within its voxel is below.
  const auto at = [&](double z_m) {
    return check_clearance(over_the_hall(z_m), finer.view(), 1010 * kNsPerSecond);
  };
  EXPECT_EQ(at(1.285).verdict, Verdict::kClear);
  EXPECT_EQ(at(1.285).safe_height_m, 1.285) << "what is clear is its own next clear height";
  EXPECT_EQ(at(1.275).verdict, Verdict::kBlocked);
  EXPECT_EQ(check_clearance(over_the_hall(1.285), map.view(), 1010 * kNsPerSecond).verdict,
            Verdict::kBlocked);
  for (auto& [key, tile] : finer.heights)
    for (ColumnHeight& c : tile.columns) c.lower_bound = true;
  EXPECT_EQ(at(1.285).verdict, Verdict::kBlocked) << "it may be higher: that height says nothing";
}

TEST(Clearance, TheNextClearHeightIsNeverBelowTheOneAskedFor) {
  TestMap map = hall_with_a_box();
  for (int x = -5; x < 5; ++x) map.set(x, 0, 30, Occupancy::kUnknown);  // at 3 m, free above
  map.finish(1000 * kNsPerSecond);
  const auto at = [&](double z_m) {
    return check_clearance(over_the_hall(z_m), map.view(), 1010 * kNsPerSecond);
  };
  EXPECT_NEAR(at(0.6).safe_height_m, 1.3, 1e-9);
  EXPECT_NEAR(at(0.6).safe_high_m, 3 - 0.5 - 0.1, 1e-9);
  EXPECT_EQ(at(2).verdict, Verdict::kClear);
  EXPECT_EQ(at(2).safe_height_m, 2);
  EXPECT_NEAR(at(2).safe_low_m, 1.3, 1e-9);
  EXPECT_EQ(at(2.6).verdict, Verdict::kBlocked);
  EXPECT_NEAR(at(2.6).safe_height_m, 3.2, 1e-9) << "above what was not seen, not below";
  EXPECT_NEAR(at(2.6).safe_high_m, 3.4, 1e-9);
  for (const double z_m : {3.5, 9.0, 30.0}) {
    EXPECT_EQ(at(z_m).verdict, Verdict::kBlocked);
    EXPECT_TRUE(std::isnan(at(z_m).safe_height_m)) << "a crane that high is not told to come down";
  }
}

TEST(Clearance, WhatHangsAboveTheLoadBlocksUpToTheRopesTopUnlessLessIsAskedFor) {
  TestMap map = hall_with_a_box();
  for (int y = -20; y < 20; ++y) map.set(30, y, 36, Occupancy::kOccupied);  // a beam at 3.6 m
  map.finish(1000 * kNsPerSecond);
  ColumnView view = map.view();
  ClearanceQuery q = over_the_hall(2);
  EXPECT_EQ(check_clearance(q, view, q.now_ns).verdict, Verdict::kClear) << "above_m is 0";
  q.load.above_m = kToRopeTop;
  EXPECT_EQ(check_clearance(q, view, q.now_ns).reason, Reason::kBadQuery) << "where is that?";
  view.ceiling_m = 3.5;
  EXPECT_EQ(check_clearance(q, view, q.now_ns).verdict, Verdict::kClear);
  view.ceiling_m = 4;
  const Clearance beam = check_clearance(q, view, q.now_ns);
  EXPECT_EQ(beam.reason, Reason::kObstacle);
  EXPECT_NEAR(beam.first_z_m, 3.65, 1e-9);
  EXPECT_NE(beam.text.find("above the load"), std::string::npos) << beam.text;
  EXPECT_TRUE(std::isnan(beam.safe_height_m)) << "at no height does the rope pass the beam";
  for (int y = -20; y < 20; ++y) map.set(30, y, 36, Occupancy::kUnknown);
  map.finish(1000 * kNsPerSecond);
  EXPECT_EQ(check_clearance(q, view, q.now_ns).reason, Reason::kUnknown)
      << "free needs proof there";
  EXPECT_EQ(Load{}.above_m, kToRopeTop) << "nobody leaves out by forgetting";
}

TEST(Clearance, AViewOfTooFewFramesBlocksWhereTheyAreDemanded) {
  TestMap map = hall_with_a_box();
  const auto seen = [&](std::uint8_t most, std::uint8_t at_five) {
    for (auto& [key, tile] : map.heights) {
      for (std::size_t i = 0; i < tile.columns.size(); ++i) {
        ColumnHeight& c = tile.columns[i];
        c.state = ColumnState::kFloor;
        c.views = key == TileKey{0, 0} && i == 5 ? at_five : most;
      }
      tile.sum_up();
    }
  };
  ClearanceQuery q = over_the_hall(2);
  seen(4, 1);
  EXPECT_EQ(check_clearance(q, map.view(), q.now_ns).verdict, Verdict::kClear);
  q.min_views = 2;
  const Clearance few = check_clearance(q, map.view(), q.now_ns);
  EXPECT_EQ(few.reason, Reason::kFewViews);
  EXPECT_NEAR(few.first_x_m, 0.55, 1e-9);
  EXPECT_TRUE(std::isnan(few.safe_height_m));
  seen(4, 2);
  EXPECT_EQ(check_clearance(q, map.view(), q.now_ns).verdict, Verdict::kClear);
  q.min_views = 5;
  EXPECT_EQ(check_clearance(q, map.view(), q.now_ns).verdict, Verdict::kBlocked);
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

TEST(Clearance, UnknownAndStaleAreBlocked) {
  TestMap map = hall_with_a_box();
  ClearanceQuery q = over_the_hall(2);
  EXPECT_EQ(check_clearance(q, map.view(), q.now_ns).verdict, Verdict::kClear);
  q.path[1].x_m = 9;  // beyond what was seen
  const Clearance beyond = check_clearance(q, map.view(), q.now_ns);
  EXPECT_EQ(beyond.reason, Reason::kUnknown);
  EXPECT_GT(beyond.unknown_fraction, 0.1);
  EXPECT_LT(beyond.oldest_age_s, 0);
  EXPECT_TRUE(std::isnan(beyond.safe_height_m));
  q = over_the_hall(2);
  q.max_age_s = 5;
  const Clearance stale = check_clearance(q, map.view(), q.now_ns);
  EXPECT_EQ(stale.verdict, Verdict::kBlocked);
  EXPECT_EQ(stale.reason, Reason::kStale);
  q.max_age_s = 20;
  EXPECT_EQ(check_clearance(q, map.view(), q.now_ns).verdict, Verdict::kClear);
  q = over_the_hall(3.7);  // the load's top is above all that was ever seen
  EXPECT_EQ(check_clearance(q, map.view(), q.now_ns).reason, Reason::kUnknown);
}

/// A star-shaped polygon, convex or not.
Zone random_zone(std::mt19937& random) {
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

bool in_polygon(const Zone& zone, double x, double y) {
  double turns = 0;  // winding number: another way than the one tested
  for (std::size_t i = 0; i < zone.corners.size(); ++i) {
    const Zone::Corner& a = zone.corners[i];
    const Zone::Corner& b = zone.corners[(i + 1) % zone.corners.size()];
    const double ax = a.x_m - x, ay = a.y_m - y, bx = b.x_m - x, by = b.y_m - y;
    turns += std::atan2(ax * by - ay * bx, ax * bx + ay * by);
  }
  return std::abs(turns) > 3;
}

TEST(ZoneMeeting, IsWhatADenseGridOfPointsSays) {
  std::mt19937 random(21);
  int met = 0, apart = 0;
  for (int i = 0; i < 3000; ++i) {
    const ClearanceQuery q = random_query(random);
    const Zone zone = random_zone(random);
    for (const SweptPiece& piece : sweep(q, kVoxel)) {
      const auto said = meet(piece, zone);
      double first = 1e300;
      constexpr double kStep = 0.04;
      double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;
      for (const Corner& c : piece.hull)
        x0 = std::min(x0, c.x), x1 = std::max(x1, c.x), y0 = std::min(y0, c.y),
        y1 = std::max(y1, c.y);
      for (double x = x0; x <= x1; x += kStep)
        for (double y = y0; y <= y1; y += kStep)
          if (touches(piece.hull, x, y, 1e-9) && in_polygon(zone, x, y))
            first = std::min(
                first, (x - piece.start_x) * piece.along_x + (y - piece.start_y) * piece.along_y);
      if (first < 1e300) {
        ASSERT_TRUE(said) << i;
        ASSERT_LE(said->along, first + 1e-9) << "it is met there or before";
        ++met;
      } else if (said) {
        // Only a sliver between the points of the grid.
        ASSERT_TRUE(touches(piece.hull, said->x_m - 1e-6, said->y_m - 1e-6, 2e-6)) << i;
      } else {
        ++apart;
      }
    }
  }
  EXPECT_GT(met, 1000);
  EXPECT_GT(apart, 1000);
}

TEST(Clearance, WithZonesEqualsASlowReference) {
  std::mt19937 random(22);
  int blocked_by_zone = 0, clear = 0, slow = 0;
  for (int hall = 0; hall < 20; ++hall) {
    const TestMap map = random_hall(random, hall % 2 == 1);
    std::vector<Zone> zones;
    for (int i = 0; i < 4; ++i) zones.push_back(random_zone(random));
    zones.back().active = false;
    ColumnView view = map.view();
    view.zones = &zones;
    for (int i = 0; i < 100; ++i) {
      const ClearanceQuery q = random_query(random);
      const Clearance without = check_clearance(q, map.view(), q.now_ns);
      const Clearance with = check_clearance(q, view, q.now_ns);
      bool no_go = false, slow_down = false;
      for (const SweptPiece& piece : sweep(q, kVoxel))
        for (const Zone& zone : zones) {
          if (!zone.active || !meet(piece, zone)) continue;
          if (zone.z_min_m >= piece.high_m || zone.z_max_m <= piece.low_m) continue;
          (zone.kind == Zone::Kind::kNoGo ? no_go : slow_down) = true;
        }
      const bool blocked = without.verdict == Verdict::kBlocked || no_go;
      ASSERT_EQ(with.verdict, blocked ? Verdict::kBlocked : Verdict::kClear) << hall << " " << i;
      ASSERT_EQ(with.slow_down, slow_down);
      if (without.verdict == Verdict::kClear && no_go) {
        ASSERT_EQ(with.reason, Reason::kZone);
        ASSERT_NE(with.text.find("zone " + std::to_string(with.zone)), std::string::npos);
        ++blocked_by_zone;
      }
      // At the safe height the same path is clear, flown level, whatever it was before.
      if (std::isfinite(with.safe_height_m)) {
        ClearanceQuery higher = q;
        for (Pose& p : higher.path) p.z_m = with.safe_height_m;
        const Clearance there = check_clearance(higher, view, q.now_ns);
        ASSERT_EQ(there.verdict, Verdict::kClear) << there.text << " " << with.safe_height_m;
      }
      clear += with.verdict == Verdict::kClear ? 1 : 0;
      slow += slow_down ? 1 : 0;
    }
  }
  EXPECT_GT(blocked_by_zone, 50);
  EXPECT_GT(clear, 50);
  EXPECT_GT(slow, 50);
}

TEST(Clearance, WhatIsForgottenIsStaleNotUnknown) {
  TestMap map = hall_with_a_box();
  for (int y = -3; y < 3; ++y)
    for (int z = 0; z < 40; ++z) map.set(5, y, z, Occupancy::kUnknown);
  map.finish(1000 * kNsPerSecond);
  ClearanceQuery q = over_the_hall(2.5);
  EXPECT_EQ(check_clearance(q, map.view(), q.now_ns).reason, Reason::kUnknown);
  for (int y = -3; y < 3; ++y)
    map.heights[{0, tile_of(y)}].columns[std::size_t(in_tile(y) * 32 + 5)].state =
        ColumnState::kStale;
  EXPECT_EQ(check_clearance(q, map.view(), q.now_ns).reason, Reason::kStale);
}

TEST(Clearance, RefusesSenselessQueries) {
  const TestMap map = hall_with_a_box();
  const auto refused = [&](const ClearanceQuery& q) {
    const Clearance answer = check_clearance(q, map.view(), q.now_ns);
    return answer.verdict == Verdict::kInvalid && answer.reason == Reason::kBadQuery &&
           !answer.text.empty();
  };
  ClearanceQuery q = over_the_hall(1);
  q.path.clear();
  EXPECT_TRUE(refused(q));
  q = over_the_hall(std::nan(""));
  EXPECT_TRUE(refused(q));
  q = over_the_hall(1);
  q.load.size_x_m = -1;
  EXPECT_TRUE(refused(q));
  q = over_the_hall(1);
  q.margins.sway_m = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(refused(q));
  q = over_the_hall(1);
  q.path[1].x_m = 90'000;
  EXPECT_TRUE(refused(q));
  q.path.assign(1000, {});
  EXPECT_TRUE(refused(q));
  q = over_the_hall(1);
  q.load.above_m = -2;
  EXPECT_TRUE(refused(q));
  q = over_the_hall(1);
  q.min_views = 33;
  EXPECT_TRUE(refused(q));
}

HallWithAll random_hall_with_all(std::mt19937& random) {
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

ClearanceQuery random_query_of_any_height(std::mt19937& random) {
  ClearanceQuery q = random_query(random);
  if (random() % 2 == 0) q.load.above_m = kToRopeTop;
  if (random() % 4 == 0) q.path[0].z_m = double(random() % 60) / 10;
  return q;
}

/// The path, flown level.
ClearanceQuery flat(ClearanceQuery q, double z_m) {
  for (Pose& p : q.path) p.z_m = z_m;
  return q;
}

TEST(Clearance, TheNextClearHeightIsTheFirstThatAScanUpwardsFinds) {
  std::mt19937 random(31);
  int found = 0, none = 0, higher = 0;
  for (int i = 0; i < 250; ++i) {
    const HallWithAll hall = random_hall_with_all(random);
    const ColumnView view = hall.view();
    for (int k = 0; k < 5; ++k) {
      const ClearanceQuery q = random_query_of_any_height(random);
      double asked = q.path[0].z_m;
      for (const Pose& p : q.path) asked = std::max(asked, p.z_m);
      const Clearance answer = check_clearance(q, view, q.now_ns);
      const auto clear_at = [&](double z_m) {
        return check_clearance(flat(q, z_m), view, q.now_ns).verdict == Verdict::kClear;
      };
      const bool any = std::isfinite(answer.safe_height_m);
      for (double z_m = asked; z_m < (any ? answer.safe_height_m : 6.0); z_m += 0.037)
        ASSERT_FALSE(clear_at(z_m))
            << i << " " << k << ": clear at " << z_m << ", said " << answer.safe_height_m;
      ASSERT_EQ(any, std::isfinite(answer.safe_low_m) && std::isfinite(answer.safe_high_m));
      if (!any) {
        ++none;
        continue;
      }
      ASSERT_GE(answer.safe_height_m, asked);
      ASSERT_LE(answer.safe_low_m, answer.safe_height_m);
      ASSERT_LE(answer.safe_height_m, answer.safe_high_m);
      for (const double share : {0.0, 0.3, 0.7, 1.0})
        ASSERT_TRUE(clear_at(answer.safe_low_m + share * (answer.safe_high_m - answer.safe_low_m)))
            << i << " " << k << ": " << answer.safe_low_m << " .. " << answer.safe_high_m;
      ASSERT_TRUE(clear_at(answer.safe_height_m));
      ASSERT_FALSE(clear_at(answer.safe_low_m - 1e-3)) << "the interval begins lower";
      ASSERT_FALSE(clear_at(answer.safe_high_m + 1e-3)) << "the interval ends higher";
      ++found;
      higher += answer.safe_height_m > asked ? 1 : 0;
    }
  }
  EXPECT_GT(found, 150);
  EXPECT_GT(none, 150);
  EXPECT_GT(higher, 50);
}

TEST(Clearance, TheNextClearHeightIsClearWithAgesAndViewsDemandedAsWell) {
  std::mt19937 random(35);
  int found = 0;
  for (int i = 0; i < 120; ++i) {
    HallWithAll hall = random_hall_with_all(random);
    for (auto& [key, tile] : hall.map.heights) {
      for (ColumnHeight& c : tile.columns) {
        c.state = ColumnState::kFloor;
        c.views = random() % 300 == 0 ? 1 : 3;
        if (random() % 300 == 0) c.last_observed = 900 * kNsPerSecond;
      }
      tile.sum_up();
    }
    const ColumnView view = hall.view();
    for (int k = 0; k < 5; ++k) {
      ClearanceQuery q = random_query_of_any_height(random);
      if (random() % 2 == 0) q.min_views = 2;
      if (random() % 2 == 0) q.max_age_s = 50;
      const Clearance answer = check_clearance(q, view, q.now_ns);
      if (std::isnan(answer.safe_height_m)) continue;
      ++found;
      const Clearance there = check_clearance(flat(q, answer.safe_height_m), view, q.now_ns);
      ASSERT_EQ(there.verdict, Verdict::kClear) << i << " " << k << ": " << there.text;
    }
  }
  EXPECT_GT(found, 20);
}

TEST(Clearance, UpToTheRopesTopEqualsASlowReference) {
  std::mt19937 random(32);
  int clear = 0, blocked_above = 0;
  for (int i = 0; i < 120; ++i) {
    const HallWithAll hall = random_hall_with_all(random);
    ColumnView view = hall.view();
    view.zones = nullptr;
    for (int k = 0; k < 5; ++k) {
      ClearanceQuery q = random_query_of_any_height(random);
      q.load.above_m = kToRopeTop;
      bool free = true, box_free = true;
      for (const SweptPiece& piece : sweep(q, kVoxel)) {  // of the box
        box_free &= all_free(hall.map, piece.hull, piece.low_m, piece.high_m);
        free &= all_free(hall.map, piece.hull, piece.low_m,
                         std::max(piece.high_m, hall.ceiling_m - 1e-9));
      }
      const Clearance answer = check_clearance(q, view, q.now_ns);
      ASSERT_EQ(answer.verdict, free ? Verdict::kClear : Verdict::kBlocked) << i << " " << k;
      clear += free ? 1 : 0;
      blocked_above += box_free && !free ? 1 : 0;
    }
  }
  EXPECT_GT(clear, 40);
  EXPECT_GT(blocked_above, 40);
}

TEST(Clearance, ACostIsCountedThatIsNeverLessThanWhatIsDone) {
  std::mt19937 random(33);
  for (int i = 0; i < 2000; ++i) {
    ClearanceQuery q = random_query(random);
    if (random() % 3 == 0) q.path.back().yaw_rad += double(random() % 60) - 30;
    if (random() % 3 == 0) q.path.back().z_m += double(random() % 30);
    if (random() % 3 == 0) q.load.size_x_m = 0, q.load.size_y_m = 0, q.margins.horizontal_m = 0;
    const SweepSize said = sweep_size(q, kVoxel);
    double columns = 0;
    const auto pieces = sweep(q, kVoxel);
    for (const SweptPiece& piece : pieces)
      for (const PolygonRow& row : rows_of(piece.hull, kVoxel)) columns += row.last - row.first + 1;
    ASSERT_EQ(said.pieces, double(pieces.size()));
    ASSERT_GE(said.columns, columns) << i;
    ASSERT_LE(said.columns, 12 * columns + 200 * said.pieces) << "and not much more";
  }
}

TEST(Clearance, WhatWouldCostTooMuchIsRefusedWhateverMakesItCostly) {
  const TestMap map = hall_with_a_box();
  std::vector<Zone> zones(64);
  for (Zone& z : zones) {
    z.active = true;
    z.z_max_m = 100;
    for (int i = 0; i < 32; ++i)
      z.corners.push_back({50 * std::cos(i * 0.19), 50 * std::sin(i * 0.19)});
  }
  ColumnView view = map.view();
  const auto refused = [&](const ClearanceQuery& q) {
    return check_clearance(q, view, q.now_ns).reason == Reason::kBadQuery;
  };
  ClearanceQuery q = over_the_hall(1);
  EXPECT_FALSE(refused(q));
  q.path = {{0, 0, 1, 0}};
  q.load = {100, 100, 1, 0};
  q.margins.horizontal_m = 100;
  EXPECT_TRUE(refused(q)) << "one pose, but a huge load";
  q = over_the_hall(1);
  q.load = {20, 20, 1, 0};
  q.path[1] = q.path[0];
  q.path[1].z_m = 900;
  EXPECT_TRUE(refused(q)) << "a climb in place";
  q.path[1] = q.path[0];
  q.path[1].yaw_rad = 100;
  EXPECT_TRUE(refused(q)) << "a turn in place";
  q = over_the_hall(1);
  q.load = {0, 0, 1, 0};
  q.margins = {0, 0, 0, 0};
  q.path.assign(256, {90'000, 0, 1, 0});
  for (std::size_t i = 0; i < q.path.size(); i += 2) q.path[i].x_m = -90'000;
  EXPECT_TRUE(refused(q)) << "a thin, long path";
  q = over_the_hall(1);
  q.load = {0, 0, 0, 0};
  for (std::size_t i = 1; i < 256; ++i) q.path.push_back({0.01 * double(i), 0, 1, double(i % 7)});
  q.path.resize(256);
  EXPECT_FALSE(refused(q));
  view.zones = &zones;
  EXPECT_TRUE(refused(q)) << "each piece with every corner of every zone";
}

TEST(VoxelMap, AnswersAsTheTilesThatItStandsFor) {
  std::mt19937 random(34);
  for (int hall = 0; hall < 6; ++hall) {
    const TestMap map = random_hall(random, hall % 2 == 1);
    VoxelMap voxels(kVoxel, 4);
    for (int x = -40; x < 60; ++x)
      for (int y = -40; y < 60; ++y)
        for (int z = 0; z < 40; ++z)
          if (map.at(x, y, z) != Occupancy::kUnknown) voxels.set(x, y, z, map.at(x, y, z));
    ColumnView view = map.view();
    view.ceiling_m = 4;
    for (int i = 0; i < 50; ++i) {
      const ClearanceQuery q = random_query_of_any_height(random);
      const Clearance a = check_clearance(q, view, q.now_ns);
      const Clearance b = check_clearance(q, voxels.view(), q.now_ns);
      ASSERT_EQ(a.verdict, b.verdict);
      ASSERT_EQ(a.reason, b.reason);
      ASSERT_EQ(std::isnan(a.safe_height_m), std::isnan(b.safe_height_m));
      if (std::isfinite(a.safe_height_m)) ASSERT_EQ(a.safe_height_m, b.safe_height_m);
    }
  }
}

}  // namespace
}  // namespace crane::client
