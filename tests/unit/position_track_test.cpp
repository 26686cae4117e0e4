// SPDX-License-Identifier: Apache-2.0
#include "geometry/position_track.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace crane {
namespace {

using Added = PositionTrack::Added;
using Lookup = PositionTrack::Lookup;
constexpr std::chrono::milliseconds kGap(200);
constexpr TimeNs kMs = 1'000'000;
/// Of an axis that may move as fast as it likes.
constexpr PositionLimits kAny{0, 40, kGap, 1e6, 0.03};

TEST(PositionTrack, InterpolatesToTheExposureTime) {
  PositionTrack track(kAny);
  track.add(100 * kMs, 1.0);
  track.add(150 * kMs, 2.0);
  double m = 0;
  EXPECT_EQ(track.at(110 * kMs, m), Lookup::kFound);
  EXPECT_NEAR(m, 1.2, 1e-12);
  EXPECT_EQ(track.at(150 * kMs, m), Lookup::kFound);
  EXPECT_DOUBLE_EQ(m, 2.0);
}

TEST(PositionTrack, WaitsForAReadingAfterTheExposure) {
  PositionTrack track(kAny);
  double m = 0;
  EXPECT_EQ(track.at(100, m), Lookup::kNotYet);
  track.add(100 * kMs, 1.0);
  EXPECT_EQ(track.at(101 * kMs, m), Lookup::kNotYet);
}

TEST(PositionTrack, NeverBridgesAGapNorExtrapolatesBackwards) {
  PositionTrack track(kAny);
  track.add(100 * kMs, 1.0);
  track.add(301 * kMs, 2.0);
  double m = -7;
  EXPECT_EQ(track.at(200 * kMs, m), Lookup::kGap);
  EXPECT_EQ(track.at(50 * kMs, m), Lookup::kGap);
  EXPECT_EQ(m, -7);
}

TEST(PositionTrack, RefusesNotANumberOutOfRangeAndTimeGoingBackwards) {
  PositionTrack track(kAny);
  EXPECT_EQ(track.add(1, std::numeric_limits<double>::quiet_NaN()), Added::kNotFinite);
  EXPECT_EQ(track.add(1, std::numeric_limits<double>::infinity()), Added::kNotFinite);
  EXPECT_EQ(track.add(1, 40.001), Added::kOutOfRange);
  EXPECT_EQ(track.add(1, -0.001), Added::kOutOfRange);
  EXPECT_EQ(track.add(10, 1), Added::kYes);
  EXPECT_EQ(track.add(10, 1), Added::kOutOfOrder);
  EXPECT_EQ(track.add(20, 1), Added::kYes);
  EXPECT_EQ(track.add(20, 1), Added::kOutOfOrder);
  EXPECT_EQ(track.add(19, 1), Added::kOutOfOrder);
}

TEST(PositionTrack, AReadingThatComesLateFillsAGapAndChangesNothingElsewhere) {
  PositionTrack track(kAny);
  track.add(1000 * kMs, 10);
  track.add(1100 * kMs, 11);
  EXPECT_EQ(track.add(1050 * kMs, 30), Added::kOutOfOrder);
  double m = 0;
  EXPECT_EQ(track.at(1050 * kMs, m), Lookup::kFound);
  EXPECT_DOUBLE_EQ(m, 10.5);
  // Readings from before the first one, sent again in their order.
  EXPECT_EQ(track.at(850 * kMs, m), Lookup::kGap);
  EXPECT_EQ(track.add(600 * kMs, 6), Added::kYes);
  EXPECT_EQ(track.add(750 * kMs, 7.5), Added::kYes);
  EXPECT_EQ(track.add(900 * kMs, 9), Added::kYes);
  EXPECT_EQ(track.at(850 * kMs, m), Lookup::kFound);
  EXPECT_NEAR(m, 8.5, 1e-12);
}

TEST(PositionTrack, ForgetsTheOldestWhenFull) {
  PositionTrack track(kAny, 3);
  for (int i = 1; i <= 4; ++i) track.add(i * 100 * kMs, i);
  double m = 0;
  EXPECT_EQ(track.at(150 * kMs, m), Lookup::kGap);
  EXPECT_EQ(track.at(250 * kMs, m), Lookup::kFound);
  EXPECT_EQ(track.add(100 * kMs, 1), Added::kOutOfOrder);
}

/// Of a crane, as configured by default.
constexpr PositionLimits kCrane{};

/// Readings at 20 Hz from `from` on.
void drive(PositionTrack& track, TimeNs from, int count, double start_m, double speed_mps) {
  for (int i = 0; i < count; ++i)
    track.add(from + i * 50 * kMs, start_m + speed_mps * 0.05 * i + 1e-4 * (i % 3));
}

TEST(PositionTrack, AnInterruptedBeamIsRefusedAndLeavesNoPositionBesideIt) {
  PositionTrack track(kCrane);
  drive(track, 1000 * kMs, 5, 2, 0.5);
  EXPECT_EQ(track.add(1250 * kMs, 0), Added::kOutOfRange);
  double m = 0;
  EXPECT_EQ(track.at(1240 * kMs, m), Lookup::kDoubtful) << "and need not be waited for";
  drive(track, 1300 * kMs, 5, 2.15, 0.5);
  EXPECT_EQ(track.at(1250 * kMs, m), Lookup::kDoubtful);
  EXPECT_EQ(track.at(1290 * kMs, m), Lookup::kDoubtful);
  EXPECT_EQ(track.at(1120 * kMs, m), Lookup::kFound);
  EXPECT_EQ(track.at(1320 * kMs, m), Lookup::kFound);
}

TEST(PositionTrack, WhatJumpsAwayAndComesBackIsNoPosition) {
  for (const double off_m : {2.0, -1.5, 0.4, 30.0}) {
    PositionTrack track(kCrane);
    drive(track, 1000 * kMs, 5, 5, 0.5);
    track.trust(1100 * kMs);
    EXPECT_EQ(track.add(1250 * kMs, 5.125 + off_m), Added::kJump);
    double m = 0;
    EXPECT_EQ(track.at(1250 * kMs, m), Lookup::kNotYet);
    drive(track, 1300 * kMs, 5, 5.15, 0.5);
    for (const TimeNs t : {1201, 1225, 1250, 1275, 1299})
      EXPECT_EQ(track.at(t * kMs, m), Lookup::kDoubtful) << t << " " << off_m;
    EXPECT_EQ(track.at(1330 * kMs, m), Lookup::kFound);
    EXPECT_NEAR(m, 5.165, 1e-3);
  }
}

TEST(PositionTrack, AJumpThatStaysIsNotBelievedHoweverMuchTimePasses) {
  PositionTrack track(kCrane);
  drive(track, 1000 * kMs, 5, 5, 0.5);
  track.trust(1100 * kMs);
  EXPECT_EQ(track.add(1250 * kMs, 5.45), Added::kJump);
  drive(track, 1300 * kMs, 100, 5.475, 0.5);
  double m = 0;
  for (const TimeNs t : {1310, 2000, 5000}) {
    EXPECT_EQ(track.at(t * kMs, m), Lookup::kUnconfirmed) << t;
    EXPECT_NEAR(m, 5.475 + 0.5e-3 * double(t - 1300), 1e-3);
  }
  EXPECT_FALSE(track.trusted());
  EXPECT_NEAR(track.last_jump_m(), 0.35, 0.1);
  track.trust(5000 * kMs);
  EXPECT_EQ(track.at(5010 * kMs, m), Lookup::kFound);
  EXPECT_TRUE(track.trusted());
  EXPECT_EQ(track.at(1120 * kMs, m), Lookup::kUnconfirmed) << "one of them is right, not both";
}

TEST(PositionTrack, WhileNothingRestsOnThemTheFirstReadingsMayBeTheWrongOnes) {
  PositionTrack track(kCrane);
  track.add(1000 * kMs, 17);
  drive(track, 1050 * kMs, 5, 5, 0.5);
  double m = 0;
  EXPECT_EQ(track.at(1120 * kMs, m), Lookup::kFound);
}

TEST(PositionTrack, AGapIsNoJumpWhenTheAxisCouldHaveMovedSoFar) {
  PositionTrack track(kCrane);
  drive(track, 1000 * kMs, 5, 5, 0.5);
  track.trust(1100 * kMs);
  drive(track, 3000 * kMs, 5, 8, 0.5);
  double m = 0;
  EXPECT_EQ(track.at(3120 * kMs, m), Lookup::kFound);
}

TEST(PositionTrack, ADeviceThatRepeatsItselfWhileTheAxisMovesIsNotBelieved) {
  PositionTrack track(kCrane);
  drive(track, 1000 * kMs, 10, 5, 0.5);
  int refused = 0;
  for (int i = 0; i < 20; ++i)
    refused += track.add((1500 + 50 * i) * kMs, 5.25) == Added::kStuck ? 1 : 0;
  EXPECT_GE(refused, 13);
  double m = 0;
  EXPECT_EQ(track.at(2220 * kMs, m), Lookup::kDoubtful);
}

TEST(PositionTrack, AnAxisAtRestMayRepeatItself) {
  PositionTrack track(kCrane);
  drive(track, 1000 * kMs, 40, 5, 0.02);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(track.add((3000 + 50 * i) * kMs, 5.04), Added::kYes) << i;
}

/// Whatever a device invents: a position that is found is one where the axis was.
TEST(PositionTrack, PropertyNoFaultMovesAPositionThatIsFound) {
  std::mt19937 random(7);
  const auto draw = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  int found = 0, asked = 0;
  for (int round = 0; round < 300; ++round) {
    PositionTrack track(kCrane);
    double true_m = draw(2, 30), speed = draw(-1, 1), offset = 0;
    int fault = -1, left = 0;
    std::vector<std::pair<TimeNs, double>> truth;
    for (int i = 0; i < 200; ++i) {
      const TimeNs t = (1000 + 50 * i) * kMs;
      if (i % 40 == 0) speed = draw(-1, 1);
      if (true_m < 1.5 || true_m > 35) speed = true_m < 1.5 ? 0.5 : -0.5;
      true_m += speed * 0.05;
      truth.emplace_back(t, true_m);
      if (left == 0 && i > 20 && draw(0, 1) < 0.05) {
        fault = std::uniform_int_distribution<int>(0, 3)(random);
        left = std::uniform_int_distribution<int>(1, 12)(random);
        offset = (draw(0, 1) < 0.5 ? -1 : 1) * draw(0.3, 20);
      }
      double said = true_m + draw(-0.003, 0.003);
      if (left > 0) {
        --left;
        if (fault == 0) said = 0;
        if (fault == 1) said += offset;
        if (fault == 2) said = 65'535;
        if (fault == 3) said = std::numeric_limits<double>::quiet_NaN();
      }
      track.add(t, said);
      if (i == 10) track.trust(t);
    }
    for (std::size_t i = 1; i < truth.size(); ++i) {
      double m = 0;
      ++asked;
      if (track.at((truth[i - 1].first + truth[i].first) / 2, m) != Lookup::kFound) continue;
      ++found;
      ASSERT_NEAR(m, (truth[i - 1].second + truth[i].second) / 2, 0.03) << round << " " << i;
    }
  }
  EXPECT_GT(found, asked / 3);
  EXPECT_LT(found, asked);
}

}  // namespace
}  // namespace crane
