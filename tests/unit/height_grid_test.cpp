#include "client/height_grid.hpp"

#include <gtest/gtest.h>

namespace crane::client {
namespace {

HeightColumns floor_seen() {
  HeightColumns out;
  for (ColumnHeight& c : out.columns) c = {0, 0, ColumnState::kFloor, kNsPerSecond};
  return out;
}

TEST(HeightGrid, LeavesOutWhatIsFarFromTheMiddleAndSaysHowMuch) {
  HeldMap held(1);
  for (int x = -5; x < 5; ++x) held.put(TileKey{x, 2}, 1, 1, floor_seen());
  EXPECT_EQ(height_grid(held, 0.1).tiles_left_out, 0U);
  held.put(TileKey{32767, 2}, 1, 1, floor_seen());
  held.put(TileKey{0, -32768}, 1, 1, floor_seen());
  const HeightGrid grid = height_grid(held, 0.1);
  EXPECT_EQ(grid.tiles_left_out, 2U);
  EXPECT_EQ(grid.columns, 320U);
  EXPECT_EQ(grid.rows, 32U);
  EXPECT_NEAR(grid.origin_x_m, -16, 1e-9);
  EXPECT_NEAR(grid.origin_y_m, 6.4, 1e-9);
}

TEST(HeightGrid, AHallSeenAlongItsEdgesIsWhole) {
  HeldMap held(1);
  for (int i = 0; i < 60; ++i) {
    held.put(TileKey{i, 0}, 1, 1, floor_seen());
    held.put(TileKey{0, i}, 1, 1, floor_seen());
  }
  const HeightGrid grid = height_grid(held, 0.1);
  EXPECT_EQ(grid.tiles_left_out, 0U);
  EXPECT_EQ(grid.cells.size(), 60U * 60 * 1024);
  EXPECT_EQ(grid.cells.back().surface, Surface::kUnknown);
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

}  // namespace
}  // namespace crane::client
