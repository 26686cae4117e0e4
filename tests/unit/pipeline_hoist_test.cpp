// SPDX-License-Identifier: Apache-2.0
// Hook and load are cut out of what the camera adds.

#include "mapping/heights.hpp"
#include "mapping_pipeline_fixture.hpp"

namespace crane {
namespace {

TEST_F(MappingPipelineTest, HookAndLoadAreCutOutAndWhatTheyPassedIsProvenFree) {
  HoistConfig hoist;
  hoist.enabled = true;
  hoist.offset_y_m = 0.5;
  hoist.hook_x_m = hoist.hook_y_m = 0.2;
  hoist.hook_z_m = 0.2;
  hoist.margin_m = 0.05;
  hoist.sway_m = 0;
  hoist.accuracy_m = 0.02;
  MappingPipeline builder(config(), rig_, hoist);
  for (TimeNs t = kT0 - kNsPerSecond; t <= kT0 + kNsPerSecond; t += 50 * kMs) {
    builder.add_position(Axis::kCart, 9, t, 1.0);
    builder.add_position(Axis::kTrolley, 9, t, 2.0);
    HoistReading r;  // a load going down through z = 0.9 .. 0.5
    r.time = t;
    r.hook_height_m = 1.1 - 0.2 * double(t - kT0 + kNsPerSecond) / double(2 * kNsPerSecond);
    r.sling_m = 0.1;
    r.load_size_m = {0.4, 0.4, 0.3};
    builder.add_hoist(r);
  }
  // Everything the camera sees is at the load's height: none of it may become an obstacle there.
  for (int i = 0; i < 4; ++i) {
    CloudSample c = cloud(std::uint64_t(i), kT0 + i * 100 * kMs);
    builder.add_cloud(std::move(c), clock_.now());
    ASSERT_TRUE(builder.step(clock_.now()));
  }
  EXPECT_EQ(builder.report().hoist, HoistKnown::kKnown);
  // Below the load nothing was seen; beside it the floor was.
  EXPECT_EQ(floor_at(builder.map(), 1.0, 2.8), Occupancy::kUnknown);
  EXPECT_EQ(floor_at(builder.map(), 2.0, 2.0), Occupancy::kOccupied);
  EXPECT_EQ(builder.map().at(20, 50, 14), Occupancy::kFree) << "the load was here";
  const Tile& tile = *builder.map().find({0, 1});
  const ColumnHeight proven = tile_heights(builder.map(), tile, 0.075)[18 * 32 + 20];
  EXPECT_NEAR(proven.proven_m, 0.55, 1e-6);
  EXPECT_FALSE(std::isfinite(tile_heights(builder.map(), tile, 0.075)[18 * 32 + 5].proven_m));
}

TEST_F(MappingPipelineTest, ALoadLargerThanConfiguredIsRefusedAndProvesNothing) {
  HoistConfig hoist;
  hoist.enabled = true;
  hoist.largest_load_m = 1;
  MappingPipeline builder(config(), rig_, hoist);
  HoistReading r;
  r.time = kT0;
  r.hook_height_m = 1.5;
  r.load_size_m = {1.2, 0.5, 0.5};
  builder.add_hoist(r);
  EXPECT_EQ(builder.report().counts.of(Cause::kLoadTooLarge), 1U);
  r.load_size_m.x() = 0.9;
  builder.add_hoist(r);
  EXPECT_EQ(builder.report().counts.of(Cause::kLoadTooLarge), 1U);
}

TEST_F(MappingPipelineTest, WithoutHoistStateAllBelowTheTrolleyIsUnknownAndSaid) {
  HoistConfig hoist;
  hoist.enabled = true;
  hoist.largest_load_m = 0.5;
  MappingPipeline builder(config(), rig_, hoist);
  for (TimeNs t = kT0 - kNsPerSecond; t <= kT0 + kNsPerSecond; t += 50 * kMs) {
    builder.add_position(Axis::kCart, 9, t, 1.0);
    builder.add_position(Axis::kTrolley, 9, t, 2.0);
  }
  builder.add_cloud(cloud(0, kT0), clock_.now());
  EXPECT_FALSE(builder.step(clock_.now())) << "waits for a hoist state";
  clock_.advance(std::chrono::milliseconds(301));
  EXPECT_TRUE(builder.step(clock_.now()));
  EXPECT_EQ(builder.report().hoist, HoistKnown::kLost);
  EXPECT_EQ(floor_at(builder.map(), 1.0, 2.0), Occupancy::kUnknown);
}

TEST_F(MappingPipelineTest, HoistStateOfAnotherTimeIsNamedAsThatNotAsMissing) {
  constexpr TimeNs kYears = 95'601'516 * kNsPerSecond;
  for (const TimeNs apart : {kYears, -kYears, 2 * 60 * kNsPerSecond, kNsPerSecond}) {
    HoistConfig hoist;
    hoist.enabled = true;
    MappingPipeline builder(config(), rig_, hoist);
    for (TimeNs t = kT0 - kNsPerSecond; t <= kT0 + kNsPerSecond; t += 50 * kMs) {
      builder.add_position(Axis::kCart, 9, t, 1.0);
      builder.add_position(Axis::kTrolley, 9, t, 2.0);
    }
    HoistReading r;
    r.hook_height_m = 1.5;
    for (const TimeNs t : {TimeNs{0}, 50 * kMs, 100 * kMs}) {
      r.time = kT0 + apart + t;
      builder.add_hoist(r);
    }
    builder.add_cloud(cloud(0, kT0), clock_.now());
    if (!builder.step(clock_.now())) {
      clock_.advance(std::chrono::milliseconds(301));
      ASSERT_TRUE(builder.step(clock_.now()));
    }
    const PipelineReport report = builder.report();
    EXPECT_EQ(report.hoist, HoistKnown::kLost);
    const bool of_another_time = apart != kNsPerSecond;
    EXPECT_EQ(report.counts.of(Cause::kHoistOfAnotherTime), of_another_time ? 1U : 0U);
    EXPECT_EQ(report.counts.of(Cause::kHoistUnknown), of_another_time ? 0U : 1U);
    EXPECT_NEAR(report.hoist_apart_s, of_another_time ? double(apart) * 1e-9 : 0, 0.2);
  }
}

}  // namespace
}  // namespace crane
