// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <random>

#include "map_codec/crc32c.hpp"
#include "map_codec/octomap_file.hpp"
#include "map_codec/octree_stream.hpp"
#include "map_codec/tile_codec.hpp"
#include "map_codec/tile_snapshot.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

/// Random voxels in a few tiles on both sides of zero, with runs that prune.
struct RandomMap : OccupancyMap {
  explicit RandomMap(unsigned seed) : OccupancyMap(0.05, 1U << 30U) { fill(*this, seed); }
  static void fill(OccupancyMap& map, unsigned seed);
};

void RandomMap::fill(OccupancyMap& map, unsigned seed) {
  std::mt19937 random(seed);
  for (const TileKey key : {TileKey{0, 0}, TileKey{-1, 0}, TileKey{3, -2}})
    for (int bz : {-1, 0, 2}) {
      Block& block = *map.block(map.tile(key), bz);
      for (std::size_t i = 0; i < kBlockVoxels; ++i) {
        const unsigned what = random() % 8;
        const bool run = (i / 16384) == 1;  // the upper half of a block is all free
        block.log_odds[i] = static_cast<std::int8_t>(run         ? -40
                                                     : what == 0 ? 27
                                                     : what < 4  ? -13
                                                                 : 0);
      }
      map.observe_surface(block, 5, bz * 32, bz * 32 * 0.05 + 0.03, 200, 100, 50);
    }
}

void write(const std::string& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
}

/// Every voxel of the map, as an OctoMap tree says it.
template <class Tree>
void expect_same_voxels(const OccupancyMap& map, const Tree& tree) {
  for (const Tile* tile : map.tiles())
    for (const auto& [bz, block] : tile->blocks)
      for (int i = 0; i < kBlockVoxels; ++i) {
        const int x = tile->key.x * 32 + i % 32;
        const int y = tile->key.y * 32 + i / 32 % 32;
        const int z = bz * 32 + i / 1024;
        const auto* node = tree.search(map.centre(x), map.centre(y), map.centre(z));
        const Occupancy said = node == nullptr             ? Occupancy::kUnknown
                               : tree.isNodeOccupied(node) ? Occupancy::kOccupied
                                                           : Occupancy::kFree;
        ASSERT_EQ(said, block->at(i)) << x << " " << y << " " << z;
      }
}

TEST(Crc32c, HasTheStandardCheckValue) {
  const std::string text = "123456789";
  EXPECT_EQ(crc32c({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}), 0xE3069283U);
}

TEST(OctreeStream, OctomapReadsTheBtVoxelForVoxel) {
  const RandomMap map(1);
  const test::TempFolder folder;
  write(folder / "map.bt", write_bt(map));
  octomap::OcTree tree(1);
  ASSERT_TRUE(tree.readBinary(folder / "map.bt"));
  EXPECT_DOUBLE_EQ(tree.getResolution(), 0.05);
  expect_same_voxels(map, tree);
  // The same tree as OctoMap itself would write: pruned as far as can be.
  const std::size_t nodes = tree.calcNumNodes();
  tree.prune();
  EXPECT_EQ(tree.calcNumNodes(), nodes);
}

TEST(OctreeStream, OctomapReadsTheColourOtVoxelForVoxelWithItsColours) {
  const RandomMap map(2);
  const test::TempFolder folder;
  write(folder / "map.ot", write_colour_ot(map));
  const std::unique_ptr<octomap::AbstractOcTree> any(
      octomap::AbstractOcTree::read(folder / "map.ot"));
  auto* tree = dynamic_cast<octomap::ColorOcTree*>(any.get());
  ASSERT_NE(tree, nullptr);
  expect_same_voxels(map, *tree);
  for (const Tile* tile : map.tiles())
    for (const auto& [bz, block] : tile->blocks) {
      if (block->at(5) != Occupancy::kOccupied) continue;
      const auto* node = tree->search(map.centre(tile->key.x * 32 + 5),
                                      map.centre(tile->key.y * 32), map.centre(bz * 32));
      EXPECT_EQ(node->getColor(), octomap::ColorOcTreeNode::Color(200, 100, 50));
    }
}

TEST(OctreeStream, WhatIsWrittenAgainAfterChangesIsTheSameAsWrittenAnew) {
  RandomMap map(6);
  BtWriter writer;
  EXPECT_EQ(writer.write(map), write_bt(map));
  std::mt19937 random(6);
  for (int round = 0; round < 20; ++round) {
    const TileKey key{static_cast<int>(random() % 4) - 2, static_cast<int>(random() % 4) - 2};
    Block* block = map.block(map.tile(key), static_cast<int>(random() % 3) - 1);
    ASSERT_NE(block, nullptr);
    const auto from = static_cast<std::uint32_t>(random() % kBlockVoxels);
    const auto to =
        std::min<std::uint32_t>(kBlockVoxels, from + static_cast<std::uint32_t>(random() % 4000));
    const auto value = static_cast<std::int8_t>(round % 3 == 0 ? 0 : round % 3 == 1 ? -50 : 50);
    std::fill(block->log_odds.begin() + from, block->log_odds.begin() + to, value);
    writer.changed(key);
    ASSERT_EQ(writer.write(map), write_bt(map)) << round;
  }
}

TEST(OctreeStream, AnEmptyMapIsAnEmptyTree) {
  const OccupancyMap map(0.05, 1000);
  const test::TempFolder folder;
  write(folder / "map.bt", write_bt(map));
  const auto read = read_octomap(folder / "map.bt");
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->occupied.empty());
}

TEST(TileCodec, RoundTrips) {
  const RandomMap map(3);
  for (const Tile* tile : map.tiles()) {
    EXPECT_EQ(known_bands(*tile), std::vector<int>{0});
    const auto decoded = decode_tile(encode_tile(*tile, 0), 0);
    ASSERT_TRUE(decoded) << decoded.error().text();
    EXPECT_EQ(decoded->blocks.size(), tile->blocks.size());
    for (const auto& [bz, block] : tile->blocks)
      for (int i = 0; i < kBlockVoxels; ++i)
        ASSERT_EQ(decoded->at(i % 32, i / 32 % 32, bz * 32 + i / 1024), block->at(i));
  }
}

TEST(TileCodec, BandsOfSevenBlocksBeginBelowTheFloorAndHoldEveryBlockOnce) {
  EXPECT_EQ(band_of(-1), 0);
  EXPECT_EQ(band_of(5), 0);
  EXPECT_EQ(band_of(6), 1);
  for (int bz = -50; bz < 50; ++bz) {
    EXPECT_GE(bz, first_block(band_of(bz)));
    EXPECT_LT(bz, first_block(band_of(bz) + 1));
  }
}

TEST(TileCodec, TheWorstTileFitsAUdpDatagram) {
  OccupancyMap map(0.05, 1U << 30U);
  std::mt19937 random(9);
  Tile& tile = map.tile({0, 0});
  for (int bz = -9; bz < 9; ++bz)
    for (std::int8_t& v : map.block(tile, bz)->log_odds)
      v = static_cast<std::int8_t>(random() % 3 == 0 ? 0 : random() % 2 == 0 ? kHit : kMiss);
  EXPECT_EQ(known_bands(tile), (std::vector<int>{-2, -1, 0, 1}));
  for (const int band : known_bands(tile)) {
    const Bytes bytes = encode_tile(tile, band);
    EXPECT_LE(bytes.size(), 61'440U);
    EXPECT_TRUE(decode_tile(bytes, band));
    EXPECT_FALSE(decode_tile(bytes, band + 1)) << "blocks of another band";
  }
}

TEST(TileCodec, HeightsRoundTripToATenthOfAMillimetre) {
  TileHeights heights{};
  heights[7] = {1.23456, 0.01, ColumnState::kObstacle, 1'700'000'000 * kNsPerSecond};
  heights[8] = {-0.05, 0.002, ColumnState::kFloor, 5 * kNsPerSecond, 0.4};
  heights[9].state = ColumnState::kStale;
  const auto back = decode_heights(encode_heights(heights));
  ASSERT_TRUE(back);
  EXPECT_NEAR((*back)[7].height_m, 1.2346, 1e-9);
  EXPECT_EQ((*back)[7].last_observed, 1'700'000'000 * kNsPerSecond);
  EXPECT_NEAR((*back)[8].height_m, -0.05, 1e-9);
  EXPECT_EQ((*back)[0].state, ColumnState::kUnknown);
  EXPECT_EQ((*back)[9].state, ColumnState::kStale);
  EXPECT_NEAR((*back)[8].proven_m, 0.4, 1e-9);
  EXPECT_FALSE(std::isfinite((*back)[7].proven_m));
}

TEST(TileCodec, HeightsCarryWhatTheyRestOnAndRefuseFlagsThatMeanNothing) {
  std::mt19937 random(6);
  TileHeights heights{};
  for (ColumnHeight& c : heights) {
    c.state = static_cast<ColumnState>(random() % 4);
    c.height_m = double(random() % 10'000) * 1e-3;
    c.views = static_cast<std::uint8_t>(random() % 33);
    c.lower_bound = random() % 2 == 0;
    c.free_to_m = double(random() % 10'000) * 1e-3;
  }
  const Bytes payload = encode_heights(heights);
  EXPECT_LE(payload.size(), 24'576U);
  const auto back = decode_heights(payload);
  ASSERT_TRUE(back);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const bool known = is_known(heights[i].state);
    EXPECT_EQ((*back)[i].state, heights[i].state);
    EXPECT_EQ((*back)[i].views, known ? heights[i].views : 0);
    EXPECT_EQ((*back)[i].lower_bound, known && heights[i].lower_bound);
    EXPECT_NEAR((*back)[i].free_to_m, known ? heights[i].free_to_m : 0, 1e-9);
  }
  const Bytes raw = *decompress(payload, 1U << 20U);
  for (const unsigned state : {4U, 7U, 8U, 255U}) {  // a bound of what is unknown, and others
    Bytes bad = raw;
    bad[4 + 6 * kTileColumns + 17] = static_cast<std::uint8_t>(state);
    EXPECT_FALSE(decode_heights(compress(bad, 1))) << state;
  }
}

TEST(TileCodec, RefusesDamageWithoutTakingMemory) {
  const RandomMap map(4);
  const Bytes good = encode_tile(*map.tiles()[0], 0);
  for (std::size_t size = 0; size < good.size(); size += 97)
    EXPECT_FALSE(decode_tile(std::span(good).first(size), 0));
  EXPECT_FALSE(decode_heights(good));
  // A frame that claims 1 TiB
  const Bytes bomb = {0x28, 0xB5, 0x2F, 0xFD, 0xE0, 0, 0, 0, 0, 0, 1, 0, 0};
  EXPECT_FALSE(decode_tile(bomb, 0));
}

TEST(TileSnapshot, RestoresEverything) {
  const RandomMap map(5);
  OccupancyMap back(0.05, 1U << 30U);
  for (const Tile* tile : map.tiles())
    ASSERT_TRUE(read_snapshot(pack_snapshot(tile_bytes(*tile)), back));
  EXPECT_EQ(write_bt(back), write_bt(map));
  EXPECT_EQ(write_colour_ot(back), write_colour_ot(map));
  Bytes damaged = pack_snapshot(tile_bytes(*map.tiles()[0]));
  damaged[damaged.size() / 2] ^= 1U;
  EXPECT_FALSE(read_snapshot(damaged, back));
}

TEST(TileDigest, DependsOnPlaceAndContentButNotOnOrder) {
  EXPECT_NE(tile_digest({1, 2, 0}, 3), tile_digest({2, 1, 0}, 3));
  EXPECT_NE(tile_digest({1, 2, 0}, 3), tile_digest({1, 2, 1}, 3));
  EXPECT_NE(tile_digest({1, 2, 0}, 3), tile_digest({1, 2, 0}, 4));
  BucketDigests a, b;
  a.add({1, 2, 0}, 3);
  a.add({-5, 6, 0}, 7);
  b.add({-5, 6, 0}, 7);
  b.add({-5, 6, 1}, 8);
  b.add({1, 2, 0}, 3);
  EXPECT_NE(a.all, b.all);
  b.remove({-5, 6, 1}, 8);
  EXPECT_EQ(a.all, b.all);
  EXPECT_EQ(a.buckets, b.buckets);
}

}  // namespace
}  // namespace crane
