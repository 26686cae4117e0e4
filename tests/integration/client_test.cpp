#include "crane/client/map.hpp"

#include <gtest/gtest.h>

#include "domain.hpp"
#include "map_codec/crc32c.hpp"
#include "map_codec/octree_stream.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapper/map_publisher.hpp"
#include "recording/recording.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

class ClientTest : public ::testing::Test {
 protected:
  ClientTest()
      : rig_(Recording::open(test::rig_recording())->rig()),
        builder_(config(), rig_),
        participant_(*dds::Participant::create(test::settings(), "mapper")),
        publisher_(*MapPublisher::create(participant_, {1, 42, 7}, false)) {}

  static MapperConfig config() {
    MapperConfig c;
    c.voxel_m = 0.05;
    return c;
  }
  static std::unique_ptr<client::Map> join() {
    client::Options options;
    options.domain = test::settings().domain;
    std::string error;
    auto map = client::Map::join(options, error);
    EXPECT_NE(map, nullptr) << error;
    return map;
  }
  /// A flat thing of some height over a tile.
  void put(TileKey key, double height_m) {
    OccupancyMap& map = builder_.map();
    Tile& tile = map.tile(key);
    const int z = map.index(height_m);
    Block& block = *map.block(tile, tile_of(z));
    for (int column = 0; column < kTileColumns; ++column) {
      const int index = in_tile(z) * kTileColumns + column;
      block.log_odds[std::size_t(index)] = 60;
      map.observe_surface(block, index, z, height_m, 1, 2, 3);
      tile.columns[std::size_t(column)].last_observed = kNsPerSecond;
    }
    tile.reclassified = true;
    map.mark_changed(tile);
  }
  void publish() {
    ASSERT_TRUE(publisher_.publish_tiles(builder_, true));
    publisher_.publish_status(builder_, {});
  }

  StereoRig rig_;
  MapBuilder builder_;
  std::shared_ptr<dds::Participant> participant_;
  MapPublisher publisher_;
};

TEST_F(ClientTest, KnowsNothingBeforeAMapperIsHeard) {
  const auto map = join();
  EXPECT_FALSE(map->wait_until_complete(300ms));
  EXPECT_FALSE(map->status().heard);
  EXPECT_FALSE(map->status().valid);
  EXPECT_EQ(map->height(0, 0).surface, client::Surface::kUnknown);
}

TEST_F(ClientTest, EarlyAndLateJoinersHoldTheSameMap) {
  const auto early = join();
  for (int i = 0; i < 20; ++i) {
    put({i % 5 - 2, i / 5}, 0.1 * i);
    publish();
  }
  const auto late = join();
  ASSERT_TRUE(early->wait_until_complete(5s));
  ASSERT_TRUE(late->wait_until_complete(5s));
  EXPECT_EQ(early->status().voxel_digest, late->status().voxel_digest);
  EXPECT_EQ(early->status().height_digest, late->status().height_digest);
  EXPECT_EQ(late->status().tiles, 20U);
  EXPECT_EQ(late->status().map_id, 42U);
  EXPECT_TRUE(late->status().valid);
  EXPECT_NEAR(late->height(0.1, 0.1).height_m, 0.2, 1e-3);
  EXPECT_EQ(late->height(100, 100).surface, client::Surface::kUnknown);
  EXPECT_EQ(late->count_voxels().occupied, early->count_voxels().occupied);
}

TEST_F(ClientTest, OnlyWhatChangedIsPublished) {
  put({0, 0}, 0.5);
  put({1, 0}, 0.5);
  publish();
  const std::uint64_t before = publisher_.published_tiles();
  put({1, 0}, 0.7);
  Tile& touched = builder_.map().tile({0, 0});  // but the same
  touched.changed = touched.reclassified = true;
  publish();
  EXPECT_EQ(publisher_.published_tiles(), before + 1);
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(5s));
}

TEST_F(ClientTest, IsNotValidWithoutHeartbeats) {
  const auto map = join();
  put({0, 0}, 0.5);
  publish();
  ASSERT_TRUE(map->wait_until_complete(5s));
  EXPECT_TRUE(map->status().valid);
  std::this_thread::sleep_for(1100ms);
  EXPECT_FALSE(map->status().valid);
  EXPECT_NE(map->status().reason.find("heartbeat"), std::string::npos);
}

TEST_F(ClientTest, ATileThatFailsItsChecksumIsNotUsed) {
  const auto map = join();
  auto writer = *dds::Writer<dds::HeightTileTopic>::create(participant_);
  v1::HeightTile bad;
  bad.crane(1);
  bad.map_id(42);
  bad.voxel_m(0.05);
  bad.encoding(1);
  bad.payload(encode_heights({}));
  bad.crc32c(crc32c(bad.payload()) + 1);
  ASSERT_TRUE(writer.write(bad));
  ASSERT_TRUE(test::eventually([&] { return map->status().samples_refused == 1; }));
  EXPECT_EQ(map->heights().cells.size(), 0U);
}

TEST_F(ClientTest, TheOctreeOnTheNetworkIsABtFile) {
  put({0, 0}, 0.5);
  publish();
  ASSERT_TRUE(publisher_.publish_octree(builder_));
  auto reader = *dds::Reader<dds::OctreeMapTopic>::create(participant_, nullptr);
  std::unique_ptr<dds::Received<v1::OctreeMap>> sample;
  ASSERT_TRUE(test::eventually([&] { return (sample = reader.take()) != nullptr; }));
  EXPECT_EQ(crc32c((*sample)->payload()), (*sample)->crc32c());
  const auto file = decompress((*sample)->payload(), (*sample)->decoded_bytes());
  ASSERT_TRUE(file);
  EXPECT_EQ(*file, write_bt(builder_.map()));
}

}  // namespace
}  // namespace crane
