// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/gantry.hpp"

#include <gtest/gtest.h>

namespace crane {
namespace {

using Lookup = PositionTrack::Lookup;
constexpr TimeNs kMs = 1'000'000;

void feed(Gantry& gantry, Axis axis, std::uint64_t stream, double distance_m, TimeNs from = 0) {
  for (TimeNs t = from; t <= from + 500; t += 50)
    EXPECT_FALSE(gantry.add(axis, stream, (1000 + t) * kMs, distance_m));
}

TEST(Gantry, TwoSourcesWithStreamsOfTheirOwnDoNotClearEachOther) {
  Gantry gantry{MapperConfig{}};
  for (TimeNs t = 1000; t <= 2000; t += 50) {
    EXPECT_FALSE(gantry.add(Axis::kCart, 7, t * kMs, 3));
    EXPECT_FALSE(gantry.add(Axis::kTrolley, 8, t * kMs, 4));
  }
  const Gantry::Place place = gantry.at(1510 * kMs);
  EXPECT_EQ(place.known, Lookup::kFound);
  EXPECT_EQ(place.map_m, Eigen::Vector2d(3, 4));
  // A new stream of one axis begins anew, and leaves the other alone.
  feed(gantry, Axis::kCart, 9, 5, 2000);
  EXPECT_EQ(gantry.at(1510 * kMs).known, Lookup::kGap);
  for (TimeNs t = 2050; t <= 3500; t += 50) (void)gantry.add(Axis::kTrolley, 8, t * kMs, 4);
  EXPECT_EQ(gantry.at(3210 * kMs).map_m, Eigen::Vector2d(5, 4));
}

TEST(Gantry, DirectionAndOffsetMakeAReadingAMapCoordinate) {
  MapperConfig config;
  config.cart_direction = -1;
  config.cart_offset_m = 60;
  config.trolley_offset_m = -0.5;
  Gantry gantry(config);
  feed(gantry, Axis::kCart, 1, 57.5);
  feed(gantry, Axis::kTrolley, 1, 2);
  EXPECT_NEAR(gantry.at(1200 * kMs).map_m.x(), 2.5, 1e-12);
  EXPECT_NEAR(gantry.at(1200 * kMs).map_m.y(), 1.5, 1e-12);
}

TEST(Gantry, SaysWhichAxisAndWhy) {
  Gantry gantry{MapperConfig{}};
  feed(gantry, Axis::kCart, 1, 5);
  feed(gantry, Axis::kTrolley, 1, 5);
  gantry.trust(1200 * kMs);
  EXPECT_EQ(gantry.add(Axis::kCart, 1, 1550 * kMs, 0), Cause::kCartOutOfRange);
  EXPECT_EQ(gantry.add(Axis::kTrolley, 1, 1550 * kMs, 9), Cause::kTrolleyJump);
  EXPECT_TRUE(gantry.trusted(Axis::kCart));
  EXPECT_FALSE(gantry.trusted(Axis::kTrolley));
  EXPECT_NEAR(gantry.jump_m(Axis::kTrolley), 4, 1e-12);
  EXPECT_EQ(gantry.at(1540 * kMs).known, Lookup::kDoubtful);
}

TEST(GantrySkew, TwoRangefindersOfTheCartTellHowTheBridgeLies) {
  MapperConfig c;
  c.rangefinder_min_m = -100;
  c.rail_y_m = -2;
  c.rail_span_m = 20;
  Gantry gantry(c);
  const auto at = [&](double first_m, double second_m, TimeNs from) {
    for (const TimeNs time : {from, from + 50'000'000}) {
      (void)gantry.add(Axis::kCart, 1, time, first_m);
      (void)gantry.add(Axis::kTrolley, 1, time, 8);
    }
    EXPECT_EQ(gantry.at(from + 25'000'000).known, PositionTrack::Lookup::kNotYet)
        << "the second is waited for";
    for (const TimeNs time : {from, from + 50'000'000})
      (void)gantry.add(Axis::kCartSecond, 1, time, second_m);
    return gantry.at(from + 25'000'000);
  };
  const Gantry::Place skew = at(5, 5.1, 1'000'000'000);
  EXPECT_EQ(skew.known, PositionTrack::Lookup::kFound);
  EXPECT_NEAR(skew.map_m.x(), 5.05, 1e-9) << "the trolley is half way";
  EXPECT_NEAR(skew.map_m.y(), 8, 1e-9);
  EXPECT_NEAR(skew.skew_rad, -0.005, 1e-6);
}

TEST(GantrySkew, ASkewThatNoBridgeHasIsDoubtful) {
  MapperConfig c;
  c.rangefinder_min_m = -100;
  c.rail_span_m = 20;
  Gantry gantry(c);
  for (const TimeNs time : {0, 50'000'000}) {
    (void)gantry.add(Axis::kCart, 1, time, 5);
    (void)gantry.add(Axis::kTrolley, 1, time, 8);
    (void)gantry.add(Axis::kCartSecond, 1, time, 7);
  }
  EXPECT_EQ(gantry.at(25'000'000).known, PositionTrack::Lookup::kDoubtful);
}

}  // namespace
}  // namespace crane
