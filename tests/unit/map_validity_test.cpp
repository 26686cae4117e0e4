// SPDX-License-Identifier: Apache-2.0
#include "mapper/map_validity.hpp"

#include <gtest/gtest.h>

#include "bounds.h"

namespace crane {
namespace {

constexpr TimeNs kNow = 1000 * kNsPerSecond, kStale = 2 * kNsPerSecond;

PipelineReport well() {
  PipelineReport r;
  r.account.last_frame = 5;
  r.last_arrival = kNow - kNsPerSecond / 10;
  return r;
}

TEST(MapValidity, IsGoodWhenCloudsComeAndPositionsAreBelieved) {
  const auto health = judge_validity(well(), false, kStale, kNow);
  EXPECT_EQ(health.validity, v1::STATUS_OK);
  EXPECT_EQ(health.reason_code, v1::MAP_OK);
  EXPECT_TRUE(health.reason.empty());
}

TEST(MapValidity, WhatDriftsIsSaidOfAMapThatIsValid) {
  PipelineReport r = well();
  r.watch = WatchState::kDrifting;
  r.misfit = {Suspect::kTilt, WatchState::kDrifting, {0.003, 0.0001}};
  const auto health = judge_validity(r, false, kStale, kNow);
  EXPECT_EQ(health.validity, v1::STATUS_OK);
  EXPECT_EQ(health.reason_code, v1::MAP_DRIFTING);
  EXPECT_NE(health.reason.find("tilt"), std::string::npos) << health.reason;
}

TEST(MapValidity, EachReasonHasANumberOfItsOwnAndWords) {
  const auto code = [](auto change, bool being_made = false) {
    PipelineReport r = well();
    change(r);
    const auto health = judge_validity(r, being_made, kStale, kNow);
    EXPECT_NE(health.validity, v1::STATUS_OK);
    EXPECT_FALSE(health.reason.empty());
    EXPECT_LE(health.reason.size(), 255U);
    return health.reason_code;
  };
  EXPECT_EQ(code([](PipelineReport& r) { r.account.last_frame = -1; }), v1::MAP_NOTHING_YET);
  EXPECT_EQ(code([](PipelineReport& r) { r.last_arrival = kNow - 3 * kNsPerSecond; }),
            v1::MAP_NO_CLOUDS);
  EXPECT_EQ(code([](PipelineReport&) {}, true), v1::MAP_BEING_MADE);
  EXPECT_EQ(code([](PipelineReport& r) { r.hoist = HoistKnown::kLost; }), v1::MAP_HOIST_LOST);
  EXPECT_EQ(code([](PipelineReport& r) {
              r.hoist = HoistKnown::kLost;
              r.hoist_apart_s = 9.5e7;
            }),
            v1::MAP_HOIST_OF_ANOTHER_TIME);
  EXPECT_EQ(code([](PipelineReport& r) { r.trust = Trust::kCartJumped; }), v1::MAP_CART_POSITION);
  EXPECT_EQ(code([](PipelineReport& r) { r.trust = Trust::kTrolleyJumped; }),
            v1::MAP_TROLLEY_POSITION);
  EXPECT_EQ(code([](PipelineReport& r) { r.memory_full = true; }), v1::MAP_MEMORY_FULL);
  const auto wrong = [](Suspect suspect) {
    return [suspect](PipelineReport& r) {
      r.watch = WatchState::kWrong;
      r.misfit = {suspect, WatchState::kWrong, {0.02, 0.001}};
    };
  };
  EXPECT_EQ(code(wrong(Suspect::kToeIn)), v1::MAP_CALIBRATION_WRONG);
  EXPECT_EQ(code(wrong(Suspect::kCartScale)), v1::MAP_POSITIONS_WRONG);
  for (const Trust trust : {Trust::kContradicted, Trust::kCartReversed, Trust::kTrolleyReversed})
    EXPECT_EQ(code([trust](PipelineReport& r) { r.trust = trust; }), v1::MAP_CONTRADICTED);
  EXPECT_EQ(code([](PipelineReport& r) { r.refused = Cause::kCloudOtherCalibration; }),
            v1::MAP_OTHER_CALIBRATION);
}

TEST(MapValidity, SaysHowFarHoistStatesAndExposuresAreApart) {
  PipelineReport r = well();
  r.hoist = HoistKnown::kLost;
  r.hoist_apart_s = 95'601'516;
  EXPECT_NE(judge_validity(r, false, kStale, kNow).reason.find("95601516 s later"),
            std::string::npos);
  r.hoist_apart_s = -3600;
  EXPECT_NE(judge_validity(r, false, kStale, kNow).reason.find("3600 s earlier"),
            std::string::npos);
}

}  // namespace
}  // namespace crane
