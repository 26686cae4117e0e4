// SPDX-License-Identifier: Apache-2.0
// The map on disk, and a standby's.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <vector>

#include "map_codec/tile_codec.hpp"
#include "mapping/heights.hpp"
#include "mapping_pipeline_fixture.hpp"

namespace crane {
namespace {

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

}  // namespace
}  // namespace crane
