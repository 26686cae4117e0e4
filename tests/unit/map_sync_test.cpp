// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "map_sync/early_tiles.hpp"
#include "map_sync/held_map.hpp"
#include "map_sync/owed_tiles.hpp"
#include "map_sync/resync.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

HeightColumns floor_seen() {
  HeightColumns out;
  for (ColumnHeight& c : out.columns) c = {0, 0, ColumnState::kFloor, kNsPerSecond};
  return out;
}

TEST(HeldMap, PutsBandsTogetherAndTakesThemApartWithTheDigests) {
  HeldMap held(7);
  DecodedTile low, high;
  low.blocks[0].fill(0x55);   // all free
  high.blocks[6].fill(0xAA);  // all occupied
  const BandKey low_key{1, -2, 0}, high_key{1, -2, 1};
  EXPECT_EQ(held.put(held.prepare(low_key, 5, 100, low)), Put::kHeld);
  EXPECT_EQ(held.put(held.prepare(high_key, 5, 200, high)), Put::kHeld);
  EXPECT_EQ(held.voxel_tiles(), 2U);
  const ColumnTile* columns = held.columns({1, -2});
  ASSERT_NE(columns, nullptr);
  EXPECT_TRUE(columns->is_free(17, 3));
  EXPECT_TRUE(columns->is_occupied(17, 6 * 32 + 3));
  EXPECT_EQ(held.voxel_digests().all, tile_digest(low_key, 100) + tile_digest(high_key, 200));
  EXPECT_EQ(held.put(held.prepare(high_key, 4, 300, low)), Put::kOlder);
  EXPECT_EQ(held.put(held.prepare(high_key, 6, 300, DecodedTile{})), Put::kHeld);
  held.remove_voxels(high_key);
  held.remove_voxels(high_key);
  EXPECT_EQ(held.voxel_tiles(), 1U);
  EXPECT_EQ(held.voxel_digests().all, tile_digest(low_key, 100));
  EXPECT_FALSE(held.columns({1, -2})->is_occupied(17, 6 * 32 + 3));
  held.remove_voxels(low_key);
  EXPECT_EQ(held.columns({1, -2}), nullptr);
  EXPECT_EQ(held.voxel_digests().all, 0U);
  EXPECT_TRUE(held.tiles().empty());
}

TEST(HeldMap, TakesNothingBeyondItsBound) {
  HeldMap unbound(1);
  unbound.put(TileKey{0, 0}, 1, 1, floor_seen());
  const std::size_t one = unbound.memory_bytes();
  EXPECT_GT(one, sizeof(HeightColumns));
  HeldMap held(1, 2 * one);
  EXPECT_EQ(held.put(TileKey{0, 0}, 1, 1, floor_seen()), Put::kHeld);
  EXPECT_EQ(held.put(TileKey{1, 0}, 1, 1, floor_seen()), Put::kHeld);
  EXPECT_EQ(held.put(TileKey{2, 0}, 1, 1, floor_seen()), Put::kNoRoom);
  EXPECT_EQ(held.put(TileKey{1, 0}, 2, 7, floor_seen()), Put::kHeld) << "in place of itself";
  EXPECT_EQ(held.memory_bytes(), 2 * one);
  held.remove_heights({0, 0});
  EXPECT_EQ(held.put(TileKey{2, 0}, 1, 1, floor_seen()), Put::kHeld);
  held.remove_heights({2, 0});
  held.remove_heights({1, 0});
  EXPECT_EQ(held.memory_bytes(), 0U);
}

TEST(HeldMap, TwoBlocksFarApartCostWhatIsBetweenThemAndAreRefusedBeforeThat) {
  // A column is bits from its lowest block to its highest: 16 MiB of them for 80 bytes sent.
  HeldMap held(1, 8U << 20U);
  DecodedTile low, high;
  low.blocks[-1023].fill(0x55);
  high.blocks[1023].fill(0x55);
  const BandKey lowest{0, 0, static_cast<std::int16_t>(band_of(-1023))};
  const BandKey highest{0, 0, static_cast<std::int16_t>(band_of(1023))};
  EXPECT_EQ(held.put(held.prepare(lowest, 1, 1, low)), Put::kHeld);
  const std::size_t before = held.memory_bytes();
  const HeldMap::Voxels both = held.prepare(highest, 1, 2, high);
  EXPECT_GT(both.bytes, 16U << 20U);
  EXPECT_TRUE(both.columns.free.empty()) << "nothing is made of what has no room";
  EXPECT_EQ(held.put(both), Put::kNoRoom);
  EXPECT_EQ(held.memory_bytes(), before);
  EXPECT_EQ(held.voxel_tiles(), 1U);
}

TEST(HeldMap, RevisionsCountAnewForWhoGoesOnWithTheMap) {
  HeldMap held(1);
  EXPECT_EQ(held.put(TileKey{0, 0}, ~std::uint64_t{0}, 1, floor_seen()), Put::kHeld);
  EXPECT_EQ(held.put(TileKey{0, 0}, 5, 2, floor_seen()), Put::kOlder);
  held.forget_revisions();
  EXPECT_EQ(held.put(TileKey{0, 0}, 5, 2, floor_seen()), Put::kHeld);
}

/// A time of the steady clock, in milliseconds from an hour after its beginning.
Resync::Clock::time_point at(int ms) {
  return Resync::Clock::time_point(1h + std::chrono::milliseconds(ms));
}

TEST(Resync, AsksWhenNothingHasComeForAWhileAndAMapperLives) {
  Resync resync;
  resync.begins(at(0));
  EXPECT_EQ(resync.due(at(690), at(600)), Resync::Ask::kNot);
  resync.arrived(at(690));
  EXPECT_EQ(resync.due(at(800), at(800)), Resync::Ask::kNot);
  EXPECT_EQ(resync.due(at(1400), at(300)), Resync::Ask::kNot) << "no heartbeat for a second";
  EXPECT_EQ(resync.due(at(1400), at(1300)), Resync::Ask::kForWhatLacks);
  EXPECT_EQ(resync.due(at(1500), at(1500)), Resync::Ask::kNot);
  resync.whole(at(1600));
  EXPECT_EQ(resync.due(at(2200), at(2200)), Resync::Ask::kNot);
}

TEST(Resync, WhoseDigestsNeverAgreeAsksForAllAndThenSeldom) {
  // A mapper that lies, or a subscriber that cannot hold it: each answer is the map for everybody.
  Resync resync;
  resync.begins(at(0));
  int asked = 0, for_all = 0;
  for (int ms = 0; ms < 600'000; ms += 50) {
    const auto ask = resync.due(at(ms), at(ms));
    asked += ask != Resync::Ask::kNot ? 1 : 0;
    for_all += ask == Resync::Ask::kForAll ? 1 : 0;
    if (ms == 3000) EXPECT_EQ(for_all, 1) << "soon, when that helps";
  }
  EXPECT_GE(asked, 20);
  EXPECT_LE(asked, 45) << "of 857 at the full pace";
  EXPECT_GE(for_all, 5);
}

TEST(Resync, RestsWhenThereIsNoRoomUnlessTheMapIsAnother) {
  Resync resync;
  resync.begins(at(0));
  resync.rests(at(100));
  EXPECT_EQ(resync.due(at(29'000), at(29'000)), Resync::Ask::kNot);
  EXPECT_EQ(resync.due(at(31'000), at(31'000)), Resync::Ask::kForWhatLacks);
  resync.rests(at(32'000));
  resync.begins(at(33'000));
  EXPECT_EQ(resync.due(at(34'000), at(34'000)), Resync::Ask::kForWhatLacks);
}

TEST(OwedTiles, GoOutOnceForAllWhoAskAndNotAgainRightAway) {
  BucketDigests voxels, heights;
  std::map<TileKey, int> published;
  for (int x = 0; x < 10; ++x) {
    published[{x, 0}] = 0;
    voxels.add({static_cast<std::int16_t>(x), 0, 0}, 7);
  }
  const std::array<std::uint64_t, kBuckets> nothing{};
  OwedTiles owed;
  std::size_t sent = 0;
  for (int ms = 0; ms < 6000; ++ms) {  // a thousand requests a second
    owed.note(nothing, heights.buckets, voxels, heights, published, at(ms));
    while (const auto next = owed.next(at(ms))) {
      EXPECT_TRUE(next->lack.voxels);
      EXPECT_FALSE(next->lack.heights);
      ++sent;
    }
  }
  EXPECT_EQ(sent, 10U * 10) << "each every 0.6 s";
  owed.note(voxels.buckets, heights.buckets, voxels, heights, published, at(9000));
  EXPECT_TRUE(owed.empty()) << "who holds it all is owed nothing";
}

TEST(EarlyTiles, WaitForTheirWriterInBoundedRoom) {
  const dds::ParticipantId one{1}, other{2};
  v1::MapTile tile;
  tile.payload().resize(60'000);
  EarlyTiles<v1::MapTile> early;
  std::size_t gone = 0;
  tile.revision(5);
  gone += early.add(one, tile, at(0));
  for (int i = 0; i < 200; ++i) gone += early.add(other, tile, at(1));
  EXPECT_EQ(gone, 0U);
  EXPECT_EQ(early.take(one).size(), 1U);
  EXPECT_EQ(early.take(one).size(), 0U);
  for (int i = 0; i < 1000; ++i) gone += early.add(other, tile, at(2));
  EXPECT_GT(gone, 900U);
  EXPECT_EQ(gone + early.take(other).size(), 1200U);
  for (int i = 0; i < 3; ++i) gone = early.add(other, tile, at(1000 * i));
  EXPECT_EQ(early.end_waits(at(2500)), 1U);
  EXPECT_EQ(early.take(other).size(), 2U);
}

}  // namespace
}  // namespace crane
