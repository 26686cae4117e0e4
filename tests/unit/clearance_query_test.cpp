// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "clearance_halls.hpp"

namespace crane::client {
namespace {

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

}  // namespace
}  // namespace crane::client
