// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "clearance_halls.hpp"
#include "client/voxel_map.hpp"

namespace crane::client {
namespace {

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
