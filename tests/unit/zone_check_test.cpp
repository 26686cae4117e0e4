// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "clearance_halls.hpp"
#include "client/zone_check.hpp"

namespace crane::client {
namespace {

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

}  // namespace
}  // namespace crane::client
