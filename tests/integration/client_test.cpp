// SPDX-License-Identifier: Apache-2.0
#include "client_fixture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <mutex>
#include <thread>

#include "map_codec/crc32c.hpp"
#include "map_codec/octree_stream.hpp"
#include "mapper/succession.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

using ClientTest = test::ClientFixture;

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
  EXPECT_EQ(late->count_columns().known, 20U * 1024);
  EXPECT_EQ(late->count_columns().lower_bounds, 20U * 1024) << "nothing was seen free above";
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
  publish();  // whose map it is, or no tile is looked at
  ASSERT_TRUE(map->wait_until_complete(5s));
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

TEST_F(ClientTest, ATileThatEmptiesIsGoneHereToo) {
  put({0, 0}, 0.5);
  put({1, 0}, 0.7);
  publish();
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  EXPECT_EQ(map->status().tiles, 2U);
  Tile& tile = builder_.map().tile({1, 0});
  for (auto& [bz, block] : tile.blocks) block->log_odds.fill(0);
  for (Column& column : tile.columns) column.stale = true;
  tile.reclassified = true;
  builder_.map().mark_changed(tile);
  publish();
  ASSERT_TRUE(test::eventually([&] { return map->status().tiles == 1; }));
  EXPECT_TRUE(map->wait_until_complete(10s));
  EXPECT_EQ(map->height(1.7, 0.1).surface, client::Surface::kStale);
  EXPECT_TRUE(client::is_known(map->height(0.1, 0.1).surface));
  const auto late = join();
  ASSERT_TRUE(late->wait_until_complete(10s));
  EXPECT_EQ(late->status().tiles, 1U);
  EXPECT_EQ(late->status().voxel_digest, map->status().voxel_digest);
}

TEST_F(ClientTest, WhatIsMissingIsAskedForAndSentAgain) {
  put({0, 0}, 0.5);
  put({40, -3}, 0.7);
  publish();
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  // An instance ends: a tile is lost here, and nothing says so but the digests.
  auto writer = *dds::Writer<dds::MapTileTopic>::create(participant_);
  ASSERT_TRUE(test::eventually([&] { return writer.matched() == 1; }));
  v1::MapTile tile;
  tile.crane(1);
  tile.tile_x(40);
  tile.tile_y(-3);
  tile.voxel_m(0.05);
  tile.encoding(1);
  tile.payload({1});
  ASSERT_TRUE(writer.write(tile));  // an instance must be known to be ended
  ASSERT_TRUE(writer.dispose(tile));
  ASSERT_TRUE(test::eventually([&] { return map->status().tiles == 1; }));
  EXPECT_FALSE(map->status().complete);
  auto requests = *dds::Reader<dds::TileRequestTopic>::create(participant_, nullptr);
  const bool whole = test::eventually([&] {
    while (const auto request = requests.take()) publisher_.note_request(**request);
    EXPECT_TRUE(publisher_.send_again(builder_));
    heartbeat_->say(publisher_.status(builder_, {}));
    return map->status().complete;
  });
  EXPECT_TRUE(whole);
  EXPECT_GE(map->status().resyncs, 1U);
  EXPECT_EQ(map->status().tiles, 2U);
  // The other tile was in another bucket and was not sent again.
  EXPECT_EQ(publisher_.counts().of(Cause::kTilesSentAgain), map->status().resyncs);
}

TEST_F(ClientTest, TilesOfAMapThatNoHeartbeatNamesChangeNothing) {
  put({0, 0}, 0.5);
  publish();
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  const client::Status before = map->status();
  auto stranger = *dds::Participant::create(test::settings(), "stranger");
  // Stronger than the mapper, so that it is heard at all.
  auto writer =
      *dds::Writer<dds::HeightTileTopic>::create(stranger, dds::HeightTileTopic::kName, 5);
  ASSERT_TRUE(test::eventually([&] { return writer.matched() == 1; }));
  TileHeights flat;
  for (ColumnHeight& c : flat) c = {0, 0, ColumnState::kFloor, kNsPerSecond};
  v1::HeightTile tile;
  tile.crane(1);
  tile.voxel_m(0.05);
  tile.encoding(1);
  tile.payload(encode_heights(flat));
  tile.crc32c(crc32c(tile.payload()));
  tile.map_id(before.map_id + 1);
  tile.revision(1'000'000);
  ASSERT_TRUE(writer.write(tile));
  tile.map_id(before.map_id);
  tile.revision(0);  // of this map, but older than what is held
  ASSERT_TRUE(writer.write(tile));
  tile.crane(2);
  ASSERT_TRUE(writer.write(tile));
  ASSERT_TRUE(test::eventually(
      [&] { return map->status().samples_refused >= before.samples_refused + 2; }));
  heartbeat_->say(publisher_.status(builder_, {}));
  EXPECT_TRUE(map->wait_until_complete(5s));
  EXPECT_EQ(map->status().height_digest, before.height_digest);
  EXPECT_NEAR(map->height(0.1, 0.1).height_m, 0.5, 0.03);
}

/// Of a callback that ends or replaces itself: whether what it holds is still there.
std::weak_ptr<int> g_held;

TEST_F(ClientTest, ACallbackMayEndOrReplaceItselfAndIsWholeUntilItReturns) {
  const auto map = join();
  std::atomic<int> first{0}, second{0};
  std::atomic<bool> whole{true};
  {
    const auto held = std::make_shared<int>(7);
    g_held = held;
    map->on_update([&first, &second, &whole, &map, held](const client::Update&) {
      ++first;
      map->on_update([&second](const client::Update&) { ++second; });
      whole = whole && !g_held.expired();
    });
  }
  put({0, 0}, 0.5);
  publish();
  ASSERT_TRUE(test::eventually([&] { return first > 0; }));
  const auto more = [&] {
    put({1 + second % 5, 1}, 0.3);
    publish();
  };
  ASSERT_TRUE(test::eventually([&] {
    more();
    return second > 0;
  }));
  EXPECT_EQ(first, 1);
  EXPECT_TRUE(whole);
  EXPECT_TRUE(test::eventually([] { return g_held.expired(); }));
  map->on_update([&](const client::Update&) {
    map->on_update(nullptr);
    ++first;
  });
  ASSERT_TRUE(test::eventually([&] {
    more();
    return first > 1;
  }));
  map->on_update(nullptr);
  EXPECT_EQ(first, 2);
}

TEST_F(ClientTest, WhatCameBeforeTheFirstHeartbeatIsToldWithIt) {
  const auto map = join();
  std::mutex mutex;
  std::vector<client::Update> updates;
  map->on_update([&](const client::Update& u) {
    const std::lock_guard lock(mutex);
    updates.push_back(u);
  });
  put({2, 1}, 0.25);
  const auto probe = *dds::Writer<dds::HeightTileTopic>::create(participant_);
  ASSERT_TRUE(test::eventually([&] { return probe.matched() == 1; }));
  ASSERT_TRUE(publisher_.publish_tiles(builder_, true));
  publisher_.flush(5s);  // they are there, but nobody has said of what map
  heartbeat_->say(publisher_.status(builder_, {}));
  ASSERT_TRUE(map->wait_until_complete(10s));
  ASSERT_TRUE(test::eventually([&] {
    const std::lock_guard lock(mutex);
    return !updates.empty();
  }));
  map->on_update(nullptr);
  for (const client::Update& u : updates) {
    EXPECT_EQ(u.map_id, 42U);
    for (const client::Area& a : u.areas) EXPECT_NEAR(a.x1_m - a.x0_m, 1.6, 1e-9);
  }
  EXPECT_NEAR(updates.front().areas.front().x0_m, 2 * 1.6, 1e-9);
}

TEST_F(ClientTest, IsToldOfChangesAndSavesWhatItHolds) {
  const auto map = join();
  std::mutex mutex;
  std::vector<client::Update> updates;
  map->on_update([&](const client::Update& u) {
    const std::lock_guard lock(mutex);
    (void)map->status();  // a callback may ask
    updates.push_back(u);
  });
  put({0, 0}, 0.5);
  put({2, 1}, 0.25);
  publish();
  ASSERT_TRUE(map->wait_until_complete(10s));
  ASSERT_TRUE(test::eventually([&] {
    const std::lock_guard lock(mutex);
    double x1 = 0;
    for (const client::Update& u : updates)
      for (const client::Area& a : u.areas) x1 = std::max(x1, a.x1_m);
    return std::abs(x1 - 3 * 1.6) < 1e-9;
  }));
  map->on_update(nullptr);
  const std::size_t told = updates.size();
  put({5, 5}, 0.3);
  publish();
  ASSERT_TRUE(test::eventually([&] { return map->status().tiles == 3; }));
  EXPECT_EQ(updates.size(), told) << "an ended callback is not called";
  const test::TempFolder folder;
  std::string error;
  ASSERT_TRUE(map->save_bt(folder / "held.bt", error)) << error;
  std::ifstream file(folder / "held.bt", std::ios::binary);
  const Bytes held((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  EXPECT_EQ(held, write_bt(builder_.map()));
  EXPECT_FALSE(map->save_bt("/proc/nowhere/map.bt", error));
  EXPECT_NE(error.find("/proc/nowhere/map.bt"), std::string::npos);
}

TEST_F(ClientTest, TilesAreSentAgainOneBudgetACall) {
  for (int i = 0; i < 5; ++i) put({i, 0}, 0.5);
  publish();
  v1::TileRequest request;  // of one who holds nothing
  request.crane(1);
  request.map_id(42);
  request.time_ns(1);
  publisher_.note_request(request);
  publisher_.note_request(request);  // two of them are served at once
  for (std::uint64_t sent = 1; sent <= 5; ++sent) {
    EXPECT_TRUE(publisher_.owes());
    ASSERT_TRUE(publisher_.send_again(builder_, 0));
    EXPECT_EQ(publisher_.counts().of(Cause::kTilesSentAgain), sent);
  }
  EXPECT_FALSE(publisher_.owes());
  request.map_id(43);  // of another map: nothing is missing of ours
  publisher_.note_request(request);
  EXPECT_FALSE(publisher_.owes());
}

TEST_F(ClientTest, ChangedTilesGoOutOneBudgetACallAndNoneIsForgotten) {
  for (int i = 0; i < 5; ++i) put({i, 0}, 0.5);
  for (std::uint64_t call = 1; call <= 5; ++call) {
    put({0, 0}, 0.5 + 0.1 * double(call));  // changes all the time
    ASSERT_TRUE(publisher_.publish_tiles(builder_, false, 0));
    EXPECT_EQ(publisher_.published_tiles(), call);
  }
  heartbeat_->say(publisher_.status(builder_, {}));
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  EXPECT_EQ(map->status().tiles, 5U);
}

class HeartbeatTest : public ::testing::Test {
 protected:
  HeartbeatTest()
      : participant_(*dds::Participant::create(test::settings(), "mapper")),
        heartbeat_(*Heartbeat::create(participant_, {1, 42, 7, 5})),
        reader_(*dds::Reader<dds::MapStatusTopic>::create(participant_, nullptr)) {
    status_.crane(1);
    status_.voxel_m(0.05);
  }
  std::shared_ptr<dds::Participant> participant_;
  std::unique_ptr<Heartbeat> heartbeat_;
  dds::Reader<dds::MapStatusTopic> reader_;
  v1::MapStatus status_;

  /// Waits for so many heartbeats for which `wanted` holds.
  template <class Wanted>
  bool hears(int count, Wanted wanted) {
    return test::eventually([&] {
      while (const auto s = reader_.take()) count -= wanted(**s) ? 1 : 0;
      return count <= 0;
    });
  }
};

TEST_F(HeartbeatTest, GoesOnWhileTheMapperIsAtALongPieceOfWork) {
  heartbeat_->keep_on(60s);
  heartbeat_->say(status_);
  // Nobody says anything more.
  EXPECT_TRUE(hears(5, [last = std::uint64_t(0)](const v1::MapStatus& s) mutable {
    const bool grows = s.sequence_number() >= last;
    last = s.sequence_number() + 1;
    return grows && s.validity() == v1::STATUS_OK;
  }));
}

TEST_F(HeartbeatTest, SaysThatNoCloudsComeEvenIfTheMapperDoesNot) {
  heartbeat_->keep_on(300ms);
  heartbeat_->alive(MonotonicClock().now());
  heartbeat_->say(status_);
  EXPECT_TRUE(hears(2, [](const v1::MapStatus& s) {
    return s.validity() == v1::STATUS_DEGRADED && s.reason_code() == v1::MAP_NO_CLOUDS;
  }));
}

TEST_F(HeartbeatTest, FallsSilentWhenTheMapperHangs) {
  heartbeat_->keep_on(60s, 300ms);
  heartbeat_->say(status_);
  EXPECT_TRUE(test::eventually([&] {
    const auto before = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - before < 700ms) {
      if (reader_.take()) return false;
      std::this_thread::sleep_for(10ms);
    }
    return true;
  }));
  heartbeat_->alive(0);
  EXPECT_TRUE(hears(1, [](const v1::MapStatus&) { return true; })) << "and goes on when it turns";
}

TEST_F(HeartbeatTest, WhoBeganAnewMomentsAgoWithHardlyAMapIsTold) {
  Wakeup wakeup;
  auto succession = *Succession::create(participant_, &wakeup, 99);
  const TimeNs now = SystemClock().now();
  const auto rival = [&](std::uint32_t tiles, TimeNs began) {
    status_.mapper(1);
    status_.term(5);
    status_.voxel_tiles(tiles);
    status_.mapper_start_ns(began);
    heartbeat_->say(status_);
    Succession::Rival seen;
    EXPECT_TRUE(test::eventually([&] { return (seen = succession.look(4, 100)).term == 5; }));
    return seen;
  };
  EXPECT_TRUE(rival(0, now).began_anew);
  EXPECT_TRUE(rival(10, now).began_anew);
  EXPECT_FALSE(rival(99, now).began_anew) << "it holds what we do";
  EXPECT_FALSE(rival(10, now - 300 * kNsPerSecond).began_anew) << "it may know what we do not";
  heartbeat_->say(status_);
  EXPECT_TRUE(hears(1, [](const v1::MapStatus&) { return true; }));
  EXPECT_EQ(succession.look(6, 100).term, 0) << "it is weaker";
}

}  // namespace
}  // namespace crane
