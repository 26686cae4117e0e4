// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "cranemap/height_picture.hpp"
#include "recording/image_file.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

client::HeightGrid grid(std::uint32_t columns, std::uint32_t rows) {
  client::HeightGrid g;
  g.cell_m = 0.1;
  g.columns = columns;
  g.rows = rows;
  g.cells.resize(std::size_t(columns) * rows);
  for (client::Height& c : g.cells) {
    c.surface = client::Surface::kFloor;
    c.views = 3;
  }
  return g;
}

/// Share of the picture's pixels that differ from that of a grid without any mark.
double differing(const client::HeightGrid& marked, const test::TempFolder& folder) {
  EXPECT_TRUE(draw_heights(folder / "plain.png", grid(marked.columns, marked.rows), {}, {}, ""));
  EXPECT_TRUE(draw_heights(folder / "marked.png", marked, {}, {}, ""));
  const auto a = read_image(folder / "plain.png", 10'000'000);
  const auto b = read_image(folder / "marked.png", 10'000'000);
  EXPECT_TRUE(a && b);
  EXPECT_EQ(a->bytes.size(), b->bytes.size());
  std::size_t differ = 0;
  for (std::size_t i = 0; i < a->bytes.size(); ++i) differ += a->bytes[i] != b->bytes[i] ? 1 : 0;
  return double(differ) / double(a->bytes.size());
}

TEST(HeightPicture, MarksWhatMayBeHigherAndWhatRestsOnOneViewEachInItsWay) {
  const test::TempFolder folder;
  client::HeightGrid bounds = grid(40, 30), one_view = grid(40, 30);
  for (client::Height& c : bounds.cells) c.lower_bound = true;
  for (client::Height& c : one_view.cells) c.views = 1;
  EXPECT_GT(differing(bounds, folder), 0.1);
  EXPECT_GT(differing(one_view, folder), 0.05);
  EXPECT_LT(differing(grid(40, 30), folder), 1e-9);
}

TEST(HeightPicture, IsDrawnOfGridsOfAnyShape) {
  const test::TempFolder folder;
  std::mt19937 random(3);
  for (const auto& [columns, rows] :
       {std::pair{1U, 1U}, {1U, 300U}, {300U, 1U}, {1200U, 2U}, {3000U, 5U}, {7U, 40U}}) {
    client::HeightGrid g = grid(columns, rows);
    for (client::Height& c : g.cells) {
      c.surface = static_cast<client::Surface>(random() % 4);
      c.height_m = double(random() % 900) / 100;
      c.lower_bound = random() % 2 == 0;
    }
    g.cells[0].surface = g.cells.back().surface = client::Surface::kObstacle;
    EXPECT_TRUE(draw_heights(folder / "any.png", g, {}, {}, "title")) << columns << " x " << rows;
  }
}

TEST(ObstacleHeights, AreNotMadeOfLowerBoundsWhereAnythingElseIsKnown) {
  TrueObstacle box;
  box.name = "box";
  box.x_m = box.y_m = 2;
  box.size_x_m = box.size_y_m = 1;
  box.height_m = 0.5;
  client::HeightGrid g = grid(40, 40);
  for (std::size_t i = 0; i < g.cells.size(); ++i) {
    client::Height& c = g.cells[i];
    c.lower_bound = g.x_m(i) < 2.2;  // most of the box, but not all of it
    c.height_m = c.lower_bound ? 0.1 : 0.5;
  }
  EXPECT_NEAR(measure(g, {box})[0].measured_m, 0.5, 1e-9);
  EXPECT_FALSE(measure(g, {box})[0].lower_bound);
  for (std::size_t i = 0; i < g.cells.size(); ++i) g.cells[i].lower_bound = g.x_m(i) < 3;
  EXPECT_GT(measure(g, {box})[0].columns, 0U) << "where nothing else is, what was seen has to do";
  EXPECT_TRUE(measure(g, {box})[0].lower_bound) << "and it is said";
  for (client::Height& c : g.cells) c.lower_bound = true;  // a map that knows no free space
  EXPECT_GT(measure(g, {box})[0].columns, 0U);
}

}  // namespace
}  // namespace crane
