// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "clearance_halls.hpp"

namespace crane::client {
namespace {

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

}  // namespace
}  // namespace crane::client
