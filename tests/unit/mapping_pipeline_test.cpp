// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/mapping_pipeline.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <vector>

#include "geometry/calibration_digest.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapper/map_store.hpp"
#include "mapping/heights.hpp"
#include "recording/recording.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kT0 = 1'000 * kNsPerSecond;

class MappingPipelineTest : public ::testing::Test {
 protected:
  MappingPipelineTest() : rig_(the_rig()), builder_(config(), rig_) {}

  static const StereoRig& the_rig() {
    static const StereoRig rig = Recording::open(test::rig_recording())->rig();
    return rig;
  }

  static MapperConfig config() {
    MapperConfig c;
    c.voxel_m = 0.05;
    c.rangefinder_min_m = 0;
    c.rangefinder_max_m = 40;
    c.largest_speed_mps = 30;
    return c;
  }
  /// A floor seen at 1.95 m.
  static CloudSample cloud(std::uint64_t number, TimeNs exposure, std::uint64_t stream = 1) {
    CloudSample c;
    c.calibration = calibration_digest(the_rig());
    c.stream = stream;
    c.sequence_number = number;
    c.exposure_time = exposure;
    c.frame.width = 160;
    c.frame.height = 90;
    c.frame.f_px = 87.5;
    c.frame.cx_px = 79.5;
    c.frame.cy_px = 44.5;
    c.frame.baseline_m = 0.12;
    c.frame.sigma_disparity_px = 0.05;
    c.depth_m.assign(160 * 90, 1.95F);
    c.confidence.assign(160 * 90, 255);
    return c;
  }
  void save_one_frame(const std::string& state) {
    positions(kT0, kT0 + 2 * kNsPerSecond);
    builder_.add_cloud(cloud(0, kT0 + kNsPerSecond), kT0 + kNsPerSecond);
    ASSERT_TRUE(builder_.step(kT0 + kNsPerSecond));
    MapStore store(state);
    store.note_changes(builder_);
    ASSERT_TRUE(store.save(builder_, {true, 1, builder_.account()}));
    ASSERT_TRUE(store.finish());
  }
  void positions(TimeNs from, TimeNs to, TimeNs step = 50 * kMs) {
    for (TimeNs t = from; t <= to; t += step) {
      builder_.add_position(Axis::kCart, 9, t, 1.0);
      builder_.add_position(Axis::kTrolley, 9, t, 2.0);
    }
  }
  std::uint64_t dropped(Cause cause) { return builder_.report().counts.of(cause); }

  /// The floor lies on the border of two voxels.
  static Occupancy floor_at(const OccupancyMap& map, double x_m, double y_m) {
    const Occupancy above = map.at(map.index(x_m), map.index(y_m), 0);
    return above != Occupancy::kUnknown ? above : map.at(map.index(x_m), map.index(y_m), -1);
  }

  StereoRig rig_;
  MappingPipeline builder_;
  FakeClock clock_{kT0};
};

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

TEST_F(MappingPipelineTest, ASavedMapGoesOnWhereItStopped) {
  const test::TempFolder folder;
  positions(kT0, kT0 + 1000 * kMs);
  builder_.add_cloud(cloud(3, kT0 + 100 * kMs), clock_.now());
  builder_.step(clock_.now());
  MapStore store(folder / "state");
  store.note_changes(builder_);
  ASSERT_TRUE(store.save(builder_, {true, 5, builder_.account()}));
  ASSERT_TRUE(store.finish());
  MappingPipeline again(config(), rig_);
  const auto state = store.load(again);
  ASSERT_TRUE(state) << state.error().text();
  EXPECT_TRUE(state->found);
  EXPECT_EQ(state->revision, 5U);
  EXPECT_EQ(again.account().last_frame, 3);
  EXPECT_EQ(again.report().age, builder_.report().age);
  EXPECT_EQ(again.map().tiles().size(), builder_.map().tiles().size());
  MapperConfig other = config();
  other.voxel_m = 0.1;
  MappingPipeline coarse(other, rig_);
  EXPECT_FALSE(store.load(coarse));
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

TEST_F(MappingPipelineTest, AnUnwritableFolderIsNamed) {
  const auto saved = save_map(builder_, "/proc/nowhere");
  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().code, ErrorCode::kResource);
  EXPECT_NE(saved.error().where.find("/proc/nowhere"), std::string::npos);
}

TEST_F(MappingPipelineTest, AStandbyThatAdoptsWhatWasPublishedHasTheSameClassesHeightsAndAges) {
  positions(kT0, kT0 + 20 * kNsPerSecond);
  for (std::uint64_t n = 0; n < 6; ++n) {
    const TimeNs exposure = kT0 + TimeNs(n + 1) * kNsPerSecond;
    builder_.add_cloud(cloud(n, exposure), exposure);
    ASSERT_TRUE(builder_.step(exposure));
  }
  const TimeNs now = kT0 + 6 * kNsPerSecond;
  MappingPipeline standby(config(), rig_);
  standby.adopt(builder_.account(), builder_.report().hoist, now);
  const double tolerance = floor_tolerance_m(0.05);
  std::size_t columns = 0;
  for (const Tile* tile : builder_.map().tiles()) {
    std::map<int, BlockClasses> blocks;
    for (const int band : known_bands(*tile)) {
      const auto decoded = decode_tile(encode_tile(*tile, band), band);
      ASSERT_TRUE(decoded);
      blocks.insert(decoded->blocks.begin(), decoded->blocks.end());
    }
    const auto heights =
        decode_heights(encode_heights(tile_heights(builder_.map(), *tile, tolerance)));
    ASSERT_TRUE(heights);
    standby.adopt(tile->key, blocks, *heights);
    const Tile* twin = standby.map().find(tile->key);
    ASSERT_NE(twin, nullptr);
    for (const int band : known_bands(*tile))
      EXPECT_EQ(decode_tile(encode_tile(*twin, band), band)->blocks,
                decode_tile(encode_tile(*tile, band), band)->blocks);
    const TileHeights after = tile_heights(standby.map(), *twin, tolerance);
    for (std::size_t i = 0; i < kTileColumns; ++i) {
      EXPECT_EQ(after[i].state, (*heights)[i].state);
      EXPECT_EQ(after[i].last_observed, (*heights)[i].last_observed);
      if (!is_known(after[i].state)) continue;
      ++columns;
      EXPECT_NEAR(after[i].height_m, (*heights)[i].height_m, 0.0005);
      EXPECT_EQ(after[i].views, (*heights)[i].views);
      EXPECT_EQ(after[i].lower_bound, (*heights)[i].lower_bound);
      EXPECT_NEAR(after[i].free_to_m, (*heights)[i].free_to_m, 1e-6);
    }
  }
  EXPECT_GT(columns, 300U);
  EXPECT_EQ(standby.account().last_frame, 5);
  EXPECT_EQ(standby.last_arrival(), now);
  // It goes on from there: the next frame is taken, one that is in the map already is not.
  for (TimeNs t = kT0; t <= kT0 + 20 * kNsPerSecond; t += 50 * kMs) {
    standby.add_position(Axis::kCart, 9, t, 1.0);
    standby.add_position(Axis::kTrolley, 9, t, 2.0);
  }
  standby.add_cloud(cloud(5, kT0 + 6 * kNsPerSecond), now);
  EXPECT_FALSE(standby.step(now));
  standby.add_cloud(cloud(6, kT0 + 7 * kNsPerSecond), now);
  EXPECT_TRUE(standby.step(now));
  EXPECT_EQ(standby.account().integrated, 7U);
  // What is not seen again is forgotten there, too.
  standby.rest(now + TimeNs(2.5 * config().forget_s) * kNsPerSecond);
  standby.rest(now + TimeNs(3 * config().forget_s) * kNsPerSecond);
  std::size_t known = 0;
  for (const Tile* tile : standby.map().tiles()) known += known_bands(*tile).size();
  EXPECT_EQ(known, 0U);
}

TEST_F(MappingPipelineTest, APartOfASavedMapIsNotTakenForTheMap) {
  const test::TempFolder folder;
  ASSERT_NO_FATAL_FAILURE(save_one_frame(folder / "state"));
  std::filesystem::path tile;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "state"))
    if (entry.path().extension() == ".tile") tile = entry.path();
  const std::filesystem::path aside = folder / "aside";
  std::filesystem::rename(tile, aside);
  MappingPipeline again(config(), rig_);
  const auto missing = MapStore(folder / "state").load(again);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kBadData);
  std::filesystem::create_directory(tile);  // what cannot be read as a file
  MappingPipeline once_more(config(), rig_);
  EXPECT_FALSE(MapStore(folder / "state").load(once_more));
  std::filesystem::remove(tile);
  std::filesystem::rename(aside, tile);
  MappingPipeline whole(config(), rig_);
  ASSERT_TRUE(MapStore(folder / "state").load(whole));
  EXPECT_EQ(whole.map().tile_count(), builder_.map().tile_count());
}

TEST_F(MappingPipelineTest, ADamagedAccountIsRefusedWhereverItIsDamaged) {
  const test::TempFolder folder;
  ASSERT_NO_FATAL_FAILURE(save_one_frame(folder / "state"));
  const std::string account = folder / "state/account.yaml";
  std::string good;
  {
    std::ifstream file(account);
    good.assign(std::istreambuf_iterator<char>(file), {});
  }
  const auto loads = [&](const std::string& text) {
    std::ofstream(account) << text;
    MappingPipeline again(config(), rig_);
    return MapStore(folder / "state").load(again).ok();
  };
  EXPECT_TRUE(loads(good));
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 1);
    EXPECT_FALSE(loads(bad)) << i;
    EXPECT_FALSE(loads(good.substr(0, i))) << "cut at " << i;
  }
  EXPECT_TRUE(loads(good));
}

TEST_F(MappingPipelineTest, ATileThatIsACopyOfAnotherIsMissed) {
  const test::TempFolder folder;
  ASSERT_NO_FATAL_FAILURE(save_one_frame(folder / "state"));
  std::vector<std::filesystem::path> tiles;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "state"))
    if (entry.path().extension() == ".tile") tiles.push_back(entry.path());
  ASSERT_GT(tiles.size(), 1U);
  std::filesystem::copy_file(tiles[0], tiles[1], std::filesystem::copy_options::overwrite_existing);
  MappingPipeline again(config(), rig_);
  EXPECT_FALSE(MapStore(folder / "state").load(again));
}

TEST_F(MappingPipelineTest, TilesThatAnEndedMapLeftBehindAreNoneOfTheNext) {
  const test::TempFolder folder;
  ASSERT_NO_FATAL_FAILURE(save_one_frame(folder / "state"));
  std::filesystem::remove(folder / "state/account.yaml");  // killed while it was ended
  MappingPipeline fresh(config(), rig_);
  MapStore next(folder / "state");
  const auto state = next.load(fresh);
  ASSERT_TRUE(state);
  EXPECT_FALSE(state->found);
  EXPECT_EQ(fresh.map().tile_count(), 0U);
  ASSERT_TRUE(next.save(fresh, {true, 1, fresh.account()}));
  ASSERT_TRUE(next.finish());
  MappingPipeline later(config(), rig_);
  ASSERT_TRUE(MapStore(folder / "state").load(later));
  EXPECT_EQ(later.map().tile_count(), 0U);
}

TEST_F(MappingPipelineTest, AStateThatCannotBeSavedIsSavedOnceItCan) {
  const test::TempFolder folder;
  positions(kT0, kT0 + 2 * kNsPerSecond);
  builder_.add_cloud(cloud(0, kT0 + kNsPerSecond), kT0 + kNsPerSecond);
  ASSERT_TRUE(builder_.step(kT0 + kNsPerSecond));
  std::ofstream(folder / "state") << "a file where the folder is to be";
  MapStore store(folder / "state");
  store.note_changes(builder_);
  ASSERT_TRUE(store.save(builder_, {true, 1, builder_.account()}));
  EXPECT_FALSE(store.finish());
  EXPECT_FALSE(store.trouble().empty());
  EXPECT_TRUE(store.unsaved()) << "its tiles are noted again";
  std::filesystem::remove(folder / "state");
  ASSERT_TRUE(store.save(builder_, {true, 2, builder_.account()}));
  EXPECT_TRUE(store.finish());
  EXPECT_TRUE(store.trouble().empty());
  MappingPipeline again(config(), rig_);
  const auto state = store.load(again);
  ASSERT_TRUE(state);
  EXPECT_EQ(state->revision, 2U);
  EXPECT_EQ(again.map().tile_count(), builder_.map().tile_count());
  EXPECT_TRUE(store.clear());
  EXPECT_FALSE(store.load(again)->found);
}

/// What a camera over a textured floor sees, wherever the positions say that it is.
class PositionsTest : public MappingPipelineTest {
 protected:
  static MapperConfig crane_config() {
    MapperConfig c;
    c.voxel_m = 0.05;
    return c;
  }
  static double grey_at(double x_m, double y_m) {
    auto h = static_cast<std::uint64_t>(std::floor(x_m / 0.1)) * 0x9E3779B97F4A7C15ULL +
             static_cast<std::uint64_t>(std::floor(y_m / 0.1));
    h = (h ^ h >> 30U) * 0xBF58476D1CE4E5B9ULL;
    h = (h ^ h >> 27U) * 0x94D049BB133111EBULL;
    return 60 + 120 * double(h >> 40U) / double(1U << 24U);
  }
  static CloudSample seen_from(std::uint64_t number, TimeNs exposure, double true_x) {
    CloudSample c = cloud(number, exposure);
    const StereoRig& rig = the_rig();
    const Eigen::Isometry3d T = Eigen::Translation3d(true_x, 2, 0) * rig.T_map_camera_at_zero;
    for (std::uint32_t v = 0; v < c.frame.height; ++v)
      for (std::uint32_t u = 0; u < c.frame.width; ++u) {
        const Eigen::Vector3d p =
            T * Eigen::Vector3d((u - c.frame.cx_px) / c.frame.f_px * 1.95,
                                (v - c.frame.cy_px) / c.frame.f_px * 1.95, 1.95);
        for (int i = 0; i < 3; ++i) c.colour.push_back(std::uint8_t(grey_at(p.x(), p.y())));
      }
    return c;
  }
  struct Step {
    double true_x, said_x;  ///< of the cart, at the exposure
  };
  /// A frame every 0.2 s, readings every 50 ms as `said` says.
  static std::vector<std::optional<Cause>> drive(MappingPipeline& pipeline, int frames,
                                                 const std::function<double(double)>& true_x,
                                                 const std::function<double(double)>& said) {
    std::vector<std::optional<Cause>> out;
    for (int i = -4; i < 4 * frames + 4; ++i) {
      const double s = 0.05 * i;
      const TimeNs t = kT0 + i * 50 * kMs;
      pipeline.add_position(Axis::kCart, 1, t, said(s));
      pipeline.add_position(Axis::kTrolley, 1, t, 2 + 1e-4 * (i % 3));
    }
    for (int n = 0; n < frames; ++n) {
      const TimeNs t = kT0 + n * 200 * kMs;
      pipeline.add_cloud(seen_from(std::uint64_t(n), t, true_x(0.2 * n)), t);
      const auto frame = pipeline.step(t);
      EXPECT_TRUE(frame) << n;
      out.push_back(frame ? frame->refused : std::nullopt);
    }
    return out;
  }
  static int count(const std::vector<std::optional<Cause>>& all, std::optional<Cause> cause) {
    return static_cast<int>(std::count(all.begin(), all.end(), cause));
  }
};

TEST_F(PositionsTest, OfACraneThatDrivesAreBelieved) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto x = [](double s) { return 3 + 0.6 * s; };
  EXPECT_EQ(count(drive(pipeline, 15, x, x), std::nullopt), 15);
  EXPECT_EQ(pipeline.report().trust, Trust::kGood);
}

TEST_F(PositionsTest, AfterAJumpNoFrameIsUsedThatDoesNotAgreeWithWhatWasSeen) {
  for (const double off_m : {0.3, -0.5, 2.0}) {
    MappingPipeline pipeline(crane_config(), rig_);
    const auto x = [](double s) { return 3 + 0.5 * s; };
    const auto frames =
        drive(pipeline, 15, x, [&](double s) { return x(s) + (s > 1.43 ? off_m : 0); });
    EXPECT_EQ(count(frames, std::nullopt), 8) << off_m;
    EXPECT_EQ(count(frames, Cause::kPositionUnconfirmed), 7) << off_m;
    EXPECT_EQ(pipeline.report().trust, Trust::kCartJumped);
    EXPECT_NEAR(pipeline.report().jump_m, off_m, 0.05);
    EXPECT_EQ(pipeline.report().counts.of(Cause::kCartJump), 1U);
  }
}

TEST_F(PositionsTest, AJumpThatFramesConfirmIsBelieved) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto steps = [](double s) { return s < 0.7 ? 3.0 : s < 1.5 ? 4.2 : 3.4; };
  EXPECT_EQ(count(drive(pipeline, 12, steps, steps), std::nullopt), 12);
  EXPECT_EQ(pipeline.report().trust, Trust::kGood);
}

TEST_F(PositionsTest, AnInterruptedBeamCostsTheFramesBesideItAndNoMore) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto x = [](double s) { return 3 + 0.5 * s; };
  const auto frames =
      drive(pipeline, 15, x, [&](double s) { return std::abs(s - 1) < 0.12 ? 0 : x(s); });
  EXPECT_EQ(count(frames, std::nullopt), 14);
  EXPECT_EQ(count(frames, Cause::kPositionDoubtful), 1);
}

TEST_F(PositionsTest, ARangefinderAtTheFarEndIsFoundOutAndSetRightByTheConfiguration) {
  const auto x = [](double s) { return 3 + 0.6 * s; };
  const auto from_the_end = [&](double s) { return 20 - x(s); };
  MappingPipeline pipeline(crane_config(), rig_);
  const auto frames = drive(pipeline, 15, x, from_the_end);
  EXPECT_LE(count(frames, std::nullopt), 2);
  EXPECT_EQ(pipeline.report().trust, Trust::kCartReversed);
  MapperConfig config = crane_config();
  config.cart_direction = -1;
  config.cart_offset_m = 20;
  MappingPipeline right(config, rig_);
  EXPECT_EQ(count(drive(right, 15, x, from_the_end), std::nullopt), 15);
}

TEST_F(PositionsTest, AWrongDirectionIsFoundOutWhereTheCraneIsMovedStepByStepToo) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto steps = [](double s) { return 3 + 0.5 * std::fmod(std::floor(s / 0.6), 3); };
  const auto frames = drive(pipeline, 15, steps, [&](double s) { return 20 - steps(s); });
  EXPECT_EQ(pipeline.report().trust, Trust::kCartReversed);
  EXPECT_LE(count(frames, std::nullopt), 4);
}

TEST_F(PositionsTest, AnOffsetTooSmallForAJumpIsFoundByFramesAndNotTakenForAWrongDirection) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto frames = drive(
      pipeline, 15, [](double) { return 3.0; },
      [](double s) { return 3 + (s > 1 ? 0.17 : 0) + 0.001 * std::sin(50 * s); });
  EXPECT_EQ(count(frames, std::nullopt), 6);
  EXPECT_EQ(pipeline.report().trust, Trust::kContradicted);
  EXPECT_EQ(pipeline.report().counts.of(Cause::kCartJump), 0U);
}

TEST_F(PositionsTest, FramesThatAgreeAgainAreUsedAgain) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto frames = drive(
      pipeline, 20, [](double) { return 3.0; },
      [](double s) { return 3 + (s > 1 && s < 2.1 ? 0.17 : 0) + 0.001 * std::sin(50 * s); });
  EXPECT_EQ(pipeline.report().trust, Trust::kGood);
  EXPECT_EQ(count(frames, std::nullopt), 6 + 7) << "after two more that agreed";
}

TEST_F(PositionsTest, ARangefinderThatHangsIsFoundOut) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto x = [](double s) { return 3 + 0.6 * s; };
  const auto frames = drive(
      pipeline, 15, x, [&](double s) { return s > 1 ? x(1) : x(s) + 0.001 * std::sin(50 * s); });
  EXPECT_GE(count(frames, std::nullopt), 5);
  EXPECT_LE(count(frames, std::nullopt), 7) << "0.2 m further at most";
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

TEST_F(PositionsTest, ACloudOfAnotherCalibrationIsRefusedAndSaid) {
  MappingPipeline pipeline(crane_config(), rig_);
  for (TimeNs t = kT0 - 200 * kMs; t <= kT0 + 200 * kMs; t += 50 * kMs)
    for (const Axis axis : {Axis::kCart, Axis::kTrolley}) pipeline.add_position(axis, 1, t, 3);
  CloudSample other = cloud(0, kT0);
  other.calibration += 1;
  pipeline.add_cloud(std::move(other), kT0);
  EXPECT_EQ(pipeline.step(kT0)->refused, Cause::kCloudOtherCalibration);
  EXPECT_EQ(pipeline.report().refused, Cause::kCloudOtherCalibration);
  EXPECT_TRUE(pipeline.map().tiles().empty());
}

}  // namespace
}  // namespace crane
