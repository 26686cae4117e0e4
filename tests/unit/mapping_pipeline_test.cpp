// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/mapping_pipeline.hpp"

#include <vector>

#include "mapping/heights.hpp"
#include "mapping_pipeline_fixture.hpp"

namespace crane {
namespace {

TEST_F(MappingPipelineTest, PlacesACloudByPositionsInterpolatedToItsExposure) {
  builder_.add_position(Axis::kCart, 9, kT0, 1.0);
  builder_.add_position(Axis::kCart, 9, kT0 + 100 * kMs, 3.0);
  builder_.add_position(Axis::kTrolley, 9, kT0, 5.0);
  builder_.add_position(Axis::kTrolley, 9, kT0 + 100 * kMs, 5.0);
  builder_.add_cloud(cloud(0, kT0 + 50 * kMs), clock_.now());
  EXPECT_TRUE(builder_.step(clock_.now()));
  EXPECT_EQ(builder_.account().integrated, 1U);
  // The floor patch is 3.56 m wide around cart 2.0: from 0.22 to 3.78.
  const OccupancyMap& map = builder_.map();
  EXPECT_EQ(floor_at(map, 0.3, 5), Occupancy::kOccupied);
  EXPECT_EQ(floor_at(map, 3.7, 5), Occupancy::kOccupied);
  EXPECT_EQ(floor_at(map, 0.1, 5), Occupancy::kUnknown);
}

TEST_F(MappingPipelineTest, LatencyOfARangefinderShiftsItsReadings) {
  MapperConfig late = config();
  late.cart_latency_ms = 50;
  MappingPipeline builder(late, rig_);
  for (int i = 0; i < 5; ++i) {
    builder.add_position(Axis::kCart, 9, kT0 + i * 50 * kMs, i);
    builder.add_position(Axis::kTrolley, 9, kT0 + i * 50 * kMs, 0);
  }
  builder.add_cloud(cloud(0, kT0 + 100 * kMs), clock_.now());
  ASSERT_TRUE(builder.step(clock_.now()));
  // At the exposure the cart really was at 3, as the reading 50 ms later says.
  const OccupancyMap& map = builder.map();
  EXPECT_EQ(floor_at(map, 3 + 1.7, 0), Occupancy::kOccupied);
  EXPECT_EQ(floor_at(map, 3 - 1.9, 0), Occupancy::kUnknown);
}

TEST_F(MappingPipelineTest, WithoutAnyPositionNothingIsMapped) {
  builder_.add_cloud(cloud(0, kT0), clock_.now());
  EXPECT_FALSE(builder_.step(clock_.now()));
  clock_.advance(std::chrono::milliseconds(1001));
  EXPECT_TRUE(builder_.step(clock_.now()));
  EXPECT_EQ(builder_.account().rejected, 1U);
  EXPECT_EQ(dropped(Cause::kPositionNone), 1U);
  EXPECT_TRUE(builder_.map().tiles().empty());
}

TEST_F(MappingPipelineTest, ACloudThatAPlayerSendsAgainWaitsForPositionsThatAreSentAgain) {
  const auto replayed = [](std::uint64_t number, TimeNs exposure) {
    CloudSample c = cloud(number, exposure);
    c.after = static_cast<std::int64_t>(number) - 1;
    return c;
  };
  positions(kT0 - 200 * kMs, kT0);
  builder_.add_cloud(replayed(0, kT0), clock_.now());
  EXPECT_TRUE(builder_.step(clock_.now()));
  positions(kT0 + 1000 * kMs, kT0 + 1200 * kMs);  // those before were lost
  builder_.add_cloud(replayed(1, kT0 + 100 * kMs), clock_.now());
  EXPECT_FALSE(builder_.step(clock_.now()));
  clock_.advance(std::chrono::seconds(2));
  EXPECT_FALSE(builder_.step(clock_.now()));
  positions(kT0 - 900 * kMs, kT0 + 1200 * kMs);
  EXPECT_TRUE(builder_.step(clock_.now()));
  EXPECT_EQ(builder_.account().integrated, 2U);
  // Where none come, only the first waits long: it ends.
  builder_.add_cloud(replayed(2, kT0 + 1300 * kMs), clock_.now());
  builder_.add_cloud(replayed(3, kT0 + 1400 * kMs), clock_.now());
  clock_.advance(std::chrono::milliseconds(5900));
  EXPECT_FALSE(builder_.step(clock_.now()));
  clock_.advance(std::chrono::milliseconds(200));
  EXPECT_TRUE(builder_.step(clock_.now()));
  EXPECT_TRUE(builder_.step(clock_.now()));
  EXPECT_EQ(builder_.account().rejected, 2U);
  EXPECT_EQ(builder_.account().missing, 0U);
}

TEST_F(MappingPipelineTest, ARangefinderGapIsNotBridged) {
  positions(kT0 - 200 * kMs, kT0);
  positions(kT0 + 300 * kMs, kT0 + 400 * kMs);
  builder_.add_cloud(cloud(0, kT0 + 100 * kMs), clock_.now());
  EXPECT_TRUE(builder_.step(clock_.now()));
  EXPECT_EQ(dropped(Cause::kPositionGap), 1U);
  EXPECT_TRUE(builder_.map().tiles().empty());
}

TEST_F(MappingPipelineTest, NanOutOfRangeAndFailedReadingsAreCountedAndNotUsed) {
  builder_.add_position(Axis::kCart, 9, kT0, std::nan(""));
  builder_.add_position(Axis::kTrolley, 9, kT0, 41);
  builder_.add_failed_position(Axis::kCart);
  EXPECT_EQ(dropped(Cause::kCartNotFinite), 1U);
  EXPECT_EQ(dropped(Cause::kTrolleyOutOfRange), 1U);
  EXPECT_EQ(dropped(Cause::kCartFailed), 1U);
  builder_.add_cloud(cloud(0, kT0), clock_.now());
  const auto frame = builder_.step(clock_.now());
  ASSERT_TRUE(frame) << "nothing better will come: it need not wait";
  EXPECT_EQ(frame->refused, Cause::kPositionDoubtful);
  EXPECT_TRUE(builder_.map().tiles().empty());
}

TEST_F(MappingPipelineTest, MissingNumbersAreCountedAndDoubleOnesIgnored) {
  positions(kT0, kT0 + 2000 * kMs);
  for (std::uint64_t number : {0, 1, 4, 4, 3}) {
    builder_.add_cloud(cloud(number, kT0 + TimeNs(number) * 100 * kMs), clock_.now());
    builder_.step(clock_.now());
  }
  EXPECT_EQ(builder_.account().integrated, 3U);
  EXPECT_EQ(builder_.account().missing, 2U);
  EXPECT_EQ(builder_.account().last_frame, 4);
}

TEST_F(MappingPipelineTest, AFullQueueGivesUpTheOldestAndCountsIt) {
  for (std::uint64_t i = 0; i <= CloudQueue::kMost; ++i)
    builder_.add_cloud(cloud(i, kT0 + TimeNs(i) * 100 * kMs), clock_.now());
  EXPECT_EQ(builder_.report().waiting, CloudQueue::kMost);
  EXPECT_EQ(dropped(Cause::kCloudQueueFull), 1U);
  EXPECT_EQ(builder_.account().rejected, 1U);
}

TEST_F(MappingPipelineTest, ANewStreamStartsANewAccountButKeepsTheMap) {
  positions(kT0, kT0 + 1000 * kMs);
  builder_.add_cloud(cloud(7, kT0 + 100 * kMs, 1), clock_.now());
  builder_.step(clock_.now());
  builder_.add_cloud(cloud(0, kT0 + 200 * kMs, 2), clock_.now());
  builder_.step(clock_.now());
  EXPECT_EQ(builder_.account().stream, 2U);
  EXPECT_EQ(builder_.account().integrated, 1U);
  EXPECT_EQ(builder_.account().missing, 0U);
  EXPECT_FALSE(builder_.map().tiles().empty());
}

TEST_F(MappingPipelineTest, PaperMethodTakesEquationNineWhenNoVoxelIsGiven) {
  MapperConfig c = config();
  c.voxel_m = 0;
  c.method = MapperConfig::Method::kPaper;
  EXPECT_NEAR(MappingPipeline(c, rig_).voxel_m(), 0.195, 1e-9);
}

TEST_F(MappingPipelineTest, AMapBeyondWhatTilesReachIsRefused) {
  MapperConfig c = config();
  c.voxel_m = 0.005;
  EXPECT_TRUE(MappingPipeline::check(c, rig_));
  c.z_max_m = 200;
  ASSERT_FALSE(MappingPipeline::check(c, rig_));
  EXPECT_EQ(MappingPipeline::check(c, rig_).error().code, ErrorCode::kConfiguration);
  c.z_max_m = 0;
  c.rangefinder_max_m = 10'000;
  EXPECT_FALSE(MappingPipeline::check(c, rig_));
}

TEST_F(MappingPipelineTest, WhatIsNotSeenAgainIsForgotten) {
  MapperConfig c = config();
  c.forget_s = 10;
  MappingPipeline builder(c, rig_);
  for (TimeNs t = kT0 - kNsPerSecond; t <= kT0 + kNsPerSecond; t += 50 * kMs) {
    builder.add_position(Axis::kCart, 9, t, 1.0);
    builder.add_position(Axis::kTrolley, 9, t, 2.0);
  }
  for (int i = 0; i < 3; ++i) {
    builder.add_cloud(cloud(std::uint64_t(i), kT0 + i * 100 * kMs), clock_.now());
    ASSERT_TRUE(builder.step(clock_.now()));
  }
  const auto column = [&] {
    const Tile& tile = *builder.map().find({0, 1});
    return tile_heights(builder.map(), tile, 0.075)[10 * 32 + 20];
  };
  EXPECT_EQ(floor_at(builder.map(), 1, 2), Occupancy::kOccupied);
  EXPECT_EQ(builder.map().at(20, 40, 20), Occupancy::kFree);
  for (int s = 0; s < 8; ++s) {  // the camera is silent; time is not
    clock_.advance(std::chrono::seconds(1));
    builder.rest(clock_.now());
  }
  EXPECT_EQ(column().state, ColumnState::kFloor);
  for (int s = 0; s < 4; ++s) {
    clock_.advance(std::chrono::seconds(1));
    builder.rest(clock_.now());
  }
  EXPECT_EQ(floor_at(builder.map(), 1, 2), Occupancy::kUnknown);
  EXPECT_EQ(builder.map().at(20, 40, 20), Occupancy::kUnknown) << "never free, never occupied";
  EXPECT_EQ(column().state, ColumnState::kStale);
  EXPECT_EQ(column().last_observed, kT0 + 200 * kMs);
}

TEST_F(MappingPipelineTest, AMapThatIsFullGrowsNoFurtherAndSaysSo) {
  MapperConfig c = config();
  c.max_memory_mib = 1;
  c.largest_speed_mps = 1000;
  MappingPipeline pipeline(c, rig_);
  std::size_t most = 0;
  for (int n = 0; n < 40; ++n) {
    const TimeNs t = kT0 + n * 100 * kMs;
    for (const TimeNs dt : {-20 * kMs, 20 * kMs}) {
      pipeline.add_position(Axis::kCart, 1, t + dt, 3 + 0.9 * n);  // ever new ground
      pipeline.add_position(Axis::kTrolley, 1, t + dt, 3);
    }
    pipeline.add_cloud(cloud(std::uint64_t(n), t), t);
    ASSERT_TRUE(pipeline.step(t));
    if (n == 20) most = pipeline.map().memory_bytes();
  }
  EXPECT_EQ(pipeline.map().memory_bytes(), most) << "nothing more is allocated";
  EXPECT_LE(most, std::size_t(1) << 20U);
  EXPECT_TRUE(pipeline.report().memory_full);
  EXPECT_GT(pipeline.report().counts.of(Cause::kMapFull), 15U);
}

}  // namespace
}  // namespace crane
