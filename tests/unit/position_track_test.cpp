#include "geometry/position_track.hpp"

#include <gtest/gtest.h>

#include <limits>

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

}  // namespace
}  // namespace crane
