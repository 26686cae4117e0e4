// SPDX-License-Identifier: Apache-2.0
// Boards of each kind in rendered images whose corners are known.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "board_images.hpp"
#include "calibration/find_board.hpp"

namespace crane {
namespace {

using ::testing::HasSubstr;

using test::render;
using test::Rendered;

class FindBoard : public ::testing::TestWithParam<const char*> {};

TEST_P(FindBoard, FindsItsCornersToATenthOfAPixel) {
  const Board board = parse_board(GetParam()).value();
  const auto finder = BoardFinder::of(board);
  ASSERT_TRUE(finder.ok());
  for (const double tilt : {0.0, 0.4, -0.6}) {
    const Rendered rendered = render(board, tilt, 0.1);
    const Corners corners = finder.value().find(rendered.image);
    ASSERT_GT(corners.ids.size(), 0.9 * double(board.corners().size())) << tilt;
    double sum = 0;
    for (std::size_t i = 0; i < corners.ids.size(); ++i)
      sum += (corners.pixels[i] - rendered.corners[std::size_t(corners.ids[i])]).squaredNorm();
    EXPECT_LT(std::sqrt(sum / (2.0 * double(corners.ids.size()))), 0.1) << tilt;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, FindBoard,
                         ::testing::Values("chessboard:9x6:0.025", "charuco:8x6:0.03:0.022:5X5_100",
                                           "aprilgrid:5x4:0.045:0.3"));

TEST(BoardFinder, SeesWhichBoardIsThereInstead) {
  const auto finder = BoardFinder::of(parse_board("chessboard:8x6:0.025").value());
  const Rendered other = render(parse_board("chessboard:9x6:0.025").value(), 0.2, 0);
  EXPECT_TRUE(finder.value().find(other.image).empty());
  EXPECT_EQ(finder.value().other_board(other.image), "9x6");
}

TEST(BoardFinder, FindsNothingInAnEmptyImage) {
  Image grey{640, 480, 1, std::vector<std::uint8_t>(640 * 480, 127)};
  for (const char* text :
       {"chessboard:9x6:0.025", "charuco:8x6:0.03:0.022:5X5_100", "aprilgrid:5x4:0.045:0.3"})
    EXPECT_TRUE(BoardFinder::of(parse_board(text).value()).value().find(grey).empty()) << text;
}

TEST(BoardFinder, RefusesADictionaryThatIsNoneOrTooSmall) {
  const auto none = BoardFinder::of(parse_board("charuco:8x6:0.03:0.022:9X9_1").value());
  ASSERT_FALSE(none.ok());
  EXPECT_THAT(none.error().text(), HasSubstr("5X5_100"));
  EXPECT_FALSE(BoardFinder::of(parse_board("charuco:20x20:0.03:0.022:4X4_50").value()).ok());
}

}  // namespace
}  // namespace crane
