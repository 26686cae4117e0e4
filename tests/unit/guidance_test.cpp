// SPDX-License-Identifier: Apache-2.0
#include "calibration/guidance.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/board_views.hpp"

namespace crane {
namespace {

using ::testing::HasSubstr;

const Board kBoard{Board::Kind::kChessboard, 9, 6, 0.03, 0, ""};

View view_of(const NextView& next) {
  // A person who does as told: the outline of the board becomes its outer corners.
  const auto corners = outline(next, kBoard, test::kBoardImages);
  View view{"", {}, {}};
  for (int r = 0; r < kBoard.rows; ++r)
    for (int c = 0; c < kBoard.columns; ++c) {
      const double a = c / 8.0, b = r / 5.0;
      const Eigen::Vector2d p = (1 - b) * ((1 - a) * corners[0] + a * corners[1]) +
                                b * ((1 - a) * corners[3] + a * corners[2]);
      view.left.ids.push_back(r * kBoard.columns + c);
      view.left.pixels.push_back(p);
    }
  view.right = view.left;
  return view;
}

TEST(Guidance, WhoDoesAsToldIsDoneAfterAFewViewsAndHasTiltedAllWays) {
  std::vector<View> views;
  Coverage coverage = rough_coverage(views, kBoard, test::kBoardImages);
  std::optional<NextView> next = next_view(coverage);
  while (next && views.size() < 40) {
    views.push_back(view_of(*next));
    coverage = rough_coverage(views, kBoard, test::kBoardImages);
    next = next_view(coverage);
  }
  EXPECT_FALSE(next) << next->words;
  EXPECT_GE(views.size(), 6U);
  EXPECT_LE(coverage.tilt_x_rad[0], -0.3);
  EXPECT_GE(coverage.tilt_x_rad[1], 0.3);
  EXPECT_LE(coverage.tilt_y_rad[0], -0.3);
  EXPECT_GE(coverage.tilt_y_rad[1], 0.3);
  EXPECT_TRUE(wanted(coverage).empty()) << wanted(coverage).front();
}

TEST(Guidance, NamesThePartThatWasSeenLeastAndTheTiltThatIsMissing) {
  Coverage c;
  c.largest = 0.5;
  for (auto& eye : c.corners) eye.fill(50);
  c.tilt_x_rad = {-0.5, 0.5};
  c.tilt_y_rad = {-0.5, 0.5};
  EXPECT_FALSE(next_view(c));
  c.corners[1][11] = 3;  // lower right, of the right camera
  EXPECT_THAT(next_view(c)->words, HasSubstr("lower right of the right image"));
  EXPECT_GT(next_view(c)->x, 0.7);
  EXPECT_GT(next_view(c)->y, 0.6);
  EXPECT_THAT(next_view(c)->words, HasSubstr("upright"));
  c.tilt_y_rad[1] = 0.1;
  EXPECT_THAT(next_view(c)->words, HasSubstr("right edge turned towards the camera"));
  // What is nearer is drawn larger.
  const auto drawn = outline(*next_view(c), kBoard, test::kBoardImages);
  EXPECT_GT(drawn[2].y() - drawn[1].y(), 1.15 * (drawn[3].y() - drawn[0].y()));
  c.tilt_x_rad[0] = 0;
  EXPECT_THAT(next_view(c)->words, HasSubstr("upper edge turned towards the camera"));
}

/// A board with its right edge nearer to the camera must count as such.
TEST(Guidance, KnowsWhichWayABoardWasTilted) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.rotate(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d right_edge = T * Eigen::Vector3d(0.24, 0, 0);
  ASSERT_LT(right_edge.z(), 0) << "nearer";
  T.translation() = Eigen::Vector3d(-0.1, -0.1, 0.6);
  std::mt19937 random(1);
  View view{"", test::seen_corners(kBoard, test::true_rig().left, T, 0, random), {}};
  ASSERT_FALSE(view.left.empty());
  view.right = view.left;
  const Coverage c = rough_coverage({view}, kBoard, test::kBoardImages);
  EXPECT_NEAR(c.tilt_y_rad[1], 0.5, 0.15);
  EXPECT_NEAR(c.tilt_x_rad[1] - c.tilt_x_rad[0], 0, 0.1);
}

TEST(Guidance, KeepsAViewThatIsNewAndAtRestAndSaysWhyNotOtherwise) {
  NextView here;
  const View view = view_of(here);
  ViewGate gate(kBoard, test::kBoardImages);
  View half = view;
  half.right = {};
  EXPECT_THAT(gate.refuse(half), HasSubstr("no board in the right image"));
  View moved = view;
  for (auto& p : moved.left.pixels) p.x() += 9;
  EXPECT_THAT(gate.refuse(moved), HasSubstr("moves (9 px)"));
  EXPECT_THAT(gate.refuse(view), HasSubstr("hold it still"));
  EXPECT_EQ(gate.refuse(view), "");
  EXPECT_THAT(gate.refuse(view), HasSubstr("as view 1"));
  here.width = 0.1;
  EXPECT_THAT(gate.refuse(view_of(here)), HasSubstr("moves"));
  EXPECT_THAT(gate.refuse(view_of(here)), HasSubstr("too far away: the board fills 10 %"));
  here = {};
  here.tilt_x_rad = 0.6;
  (void)gate.refuse(view_of(here));
  EXPECT_EQ(gate.refuse(view_of(here)), "");
  EXPECT_EQ(gate.kept().size(), 2U);
}

}  // namespace
}  // namespace crane
