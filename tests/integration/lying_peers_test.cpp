// SPDX-License-Identifier: Apache-2.0
// Peers whose samples keep the contract and lie. The client is the real one, what lies is another
// process of the network as DDS sees it.

#include <gtest/gtest.h>

#include <stdexcept>

#include "client_fixture.hpp"
#include "map_codec/crc32c.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

class LyingPeersTest : public test::ClientFixture {
 protected:
  LyingPeersTest() : liar_(*dds::Participant::create(test::settings(), "liar")) {}

  template <class Topic>
  dds::Writer<Topic> lies(int strength) const {
    auto writer = *dds::Writer<Topic>::create(liar_, Topic::kName, strength);
    EXPECT_TRUE(test::eventually([&] { return writer.matched() > 0; }));
    return writer;
  }
  /// All of a tile seen free, with a flat floor below: nothing that a decoder could object to.
  static v1::MapTile free_tile(TileKey key, std::uint64_t map_id = 42) {
    std::vector<std::uint8_t> raw = {'C', 'M', 'V', '1', 1, 0, 0, 0, 0, 0, 0, 0};
    raw.resize(raw.size() + kBlockVoxels / 4, 0x55);
    v1::MapTile tile;
    tile.tile_z(0);
    return sealed(tile, key, map_id, compress(raw, 1));
  }
  static v1::HeightTile floor_tile(TileKey key, std::uint64_t map_id = 42) {
    TileHeights flat;
    for (ColumnHeight& c : flat) c = {0, 0, ColumnState::kFloor, kNsPerSecond};
    return sealed(v1::HeightTile(), key, map_id, encode_heights(flat));
  }
  template <class Tile>
  static Tile sealed(Tile tile, TileKey key, std::uint64_t map_id, Bytes payload) {
    tile.crane(1);
    tile.tile_x(static_cast<std::int16_t>(key.x));
    tile.tile_y(static_cast<std::int16_t>(key.y));
    tile.map_id(map_id);
    tile.revision(1'000'000);
    tile.time_ns(kNsPerSecond);
    tile.voxel_m(0.05);
    tile.encoding(1);
    tile.crc32c(crc32c(payload));
    tile.payload(std::move(payload));
    return tile;
  }
  void beat() { heartbeat_->say(publisher_.status(builder_, {})); }

  std::shared_ptr<dds::Participant> liar_;
};

TEST_F(LyingPeersTest, NobodyAddsTilesToTheMapOfTheMapper) {
  put({0, 0}, 0.5);
  publish();
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  const client::Status before = map->status();
  // Weak, as strong as the mapper, and stronger: none of them is the mapper.
  auto voxels = lies<dds::MapTileTopic>(0);
  auto heights = lies<dds::HeightTileTopic>(7);
  for (const TileKey key : {TileKey{3, 3}, {-32768, -32768}, {32767, 32767}}) {
    ASSERT_TRUE(voxels.write(free_tile(key)));
    ASSERT_TRUE(heights.write(floor_tile(key)));
  }
  ASSERT_TRUE(voxels.write(free_tile({5, 5}, 43)));
  ASSERT_TRUE(test::eventually([&] {
    beat();
    return map->status().samples_refused >= before.samples_refused + 7;
  }));
  const client::Status after = map->status();
  EXPECT_TRUE(after.valid && after.complete) << after.reason;
  EXPECT_EQ(after.tiles, before.tiles);
  EXPECT_EQ(after.voxel_digest, before.voxel_digest);
  EXPECT_EQ(after.height_digest, before.height_digest);
  EXPECT_EQ(after.memory_bytes, before.memory_bytes);
  EXPECT_EQ(map->heights().cells.size(), 1024U);
}

TEST_F(LyingPeersTest, NobodyEndsTilesOfTheMapper) {
  put({0, 0}, 0.5);
  publish();
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  const std::uint64_t refused = map->status().samples_refused;
  auto voxels = lies<dds::MapTileTopic>(7);
  ASSERT_TRUE(voxels.write(free_tile({0, 0})));
  ASSERT_TRUE(voxels.dispose(free_tile({0, 0})));
  ASSERT_TRUE(test::eventually([&] { return map->status().samples_refused > refused; }));
  beat();
  EXPECT_TRUE(map->wait_until_complete(5s));
  EXPECT_EQ(map->status().tiles, 1U);
}

TEST_F(LyingPeersTest, NobodySaysTheZonesOfTheMapper) {
  put({0, 0}, 0.5);
  publish();
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  auto zones = lies<dds::ZoneSetTopic>(0);  // the mapper has said none: this is all there is
  v1::ZoneSet set;
  set.crane(1);
  set.map_id(42);
  set.revision(9);
  v1::Zone zone;
  zone.id(1);
  zone.kind(v1::ZONE_SLOW_DOWN);
  zone.z_max_m(1);
  for (const auto& [x, y] : {std::pair{0., 0.}, {1., 0.}, {1., 1.}}) {
    v1::ZoneCorner corner;
    corner.x_m(x);
    corner.y_m(y);
    zone.corners().push_back(corner);
  }
  set.zones().push_back(zone);
  ASSERT_TRUE(zones.write(set));
  ASSERT_TRUE(zones.wait_for_readers(5s));
  std::this_thread::sleep_for(300ms);  // two turns of the client and more
  beat();
  EXPECT_TRUE(map->wait_until_complete(5s));
  EXPECT_TRUE(map->zones().empty());
  EXPECT_EQ(map->status().zones_revision, 0U);
}

TEST_F(LyingPeersTest, TilesFarApartMakeNoGridOfAllThatIsBetween) {
  // The mapper's own word, so believed: a map may have two tiles at the ends of the world.
  for (int i = 0; i < 5; ++i) put({i, 0}, 0.5);
  publish();
  auto writer = *dds::Writer<dds::HeightTileTopic>::create(participant_);
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  ASSERT_TRUE(writer.write(floor_tile({-32768, -32768})));
  ASSERT_TRUE(writer.write(floor_tile({32767, 32767})));
  ASSERT_TRUE(test::eventually([&] { return map->heights().tiles_left_out == 2; }));
  const client::HeightGrid grid = map->heights();
  EXPECT_EQ(grid.columns, 5U * 32);
  EXPECT_EQ(grid.rows, 32U);
  EXPECT_NEAR(grid.origin_x_m, 0, 1e-9);
  EXPECT_EQ(client::Surface::kObstacle, grid.cells.front().surface);
}

TEST_F(LyingPeersTest, AMapLargerThanItsBoundIsInvalidAndSaysSo) {
  client::Options options;
  options.max_memory_mib = 1;  // some seven tiles
  const auto map = join(options);
  for (int i = 0; i < 30; ++i) put({i, 0}, 0.5);
  publish();
  ASSERT_TRUE(test::eventually([&] {
    beat();
    const client::Status s = map->status();
    return s.reason.find("1 MiB") != std::string::npos && s.tiles > 3;
  })) << map->status().reason << ", tiles " << map->status().tiles;
  const client::Status status = map->status();
  EXPECT_FALSE(status.valid);
  EXPECT_LE(status.memory_bytes, 1U << 20U);
  const client::Clearance answer = map->clearance({});
  EXPECT_EQ(answer.verdict, client::Verdict::kInvalid);
  EXPECT_EQ(answer.reason, client::Reason::kMapInvalid);
  EXPECT_EQ(answer.text, status.reason);
}

TEST_F(LyingPeersTest, WhoTakesOverIsBelievedWithWhatItPublishedBeforeItsFirstWord) {
  put({0, 0}, 0.5);
  publish();
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  const std::uint64_t resyncs = map->status().resyncs;
  auto other = *dds::Participant::create(test::settings(), "standby");
  MapPublisher::Identity identity{2, 42, 7, 9};
  auto publisher = *MapPublisher::create(other, identity, false);
  auto heartbeat = *Heartbeat::create(other, identity);
  publisher.restore_revision(3);  // lower than the other's may be: it is another's count
  put({0, 0}, 0.8);
  put({1, 0}, 0.3);
  auto probe = *dds::Writer<dds::HeightTileTopic>::create(other);
  ASSERT_TRUE(test::eventually([&] { return probe.matched() == 1; }));
  ASSERT_TRUE(publisher.publish_tiles(builder_, true));
  publisher.flush(5s);
  std::this_thread::sleep_for(200ms);  // they are read before the heartbeat
  ASSERT_TRUE(test::eventually([&] {
    heartbeat->say(publisher.status(builder_, {}));
    const client::Status s = map->status();
    return s.complete && s.mapper == 2;
  }));
  EXPECT_EQ(map->status().tiles, 2U);
  EXPECT_EQ(map->status().resyncs, resyncs) << "nothing had to be asked for again";
  EXPECT_NEAR(map->height(0.1, 0.1).height_m, 0.8, 0.03);
}

TEST_F(LyingPeersTest, WhatACallbackThrowsDoesNotEndTheController) {
  const auto map = join();
  std::atomic<int> calls{0};
  ASSERT_TRUE(map->on_update([&](const client::Update&) {
    ++calls;
    throw std::runtime_error("not ours");
  }));
  for (int i = 0; i < 3; ++i) {
    put({i, 0}, 0.5);
    publish();
    ASSERT_TRUE(test::eventually([&] { return calls > i; }));
  }
  EXPECT_TRUE(map->wait_until_complete(5s));
}

}  // namespace
}  // namespace crane
