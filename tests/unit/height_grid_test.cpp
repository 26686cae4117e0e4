// SPDX-License-Identifier: Apache-2.0
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

}  // namespace
}  // namespace crane::client
