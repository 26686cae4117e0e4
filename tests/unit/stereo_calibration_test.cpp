// SPDX-License-Identifier: Apache-2.0
// Calibration from views whose truth is known, and from views as people take them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "board_views.hpp"
#include "calibration/report.hpp"
#include "calibration/stereo_calibration.hpp"

namespace crane {
namespace {

using test::board_places;
using test::board_views;
using test::kBoardImages;
using test::true_rig;
using ::testing::HasSubstr;

constexpr double kNoise_px = 0.1;

const Board kBoard{Board::Kind::kChessboard, 9, 6, 0.03, 0, ""};

std::vector<View> good_views(int count = 80) {
  return board_views(kBoard, true_rig(), board_places(kBoard, count, 0.8), kNoise_px);
}

StereoCalibration calibrated(std::vector<View> views, StereoCalibrationOptions options = {}) {
  options.floor_m = 3;
  auto c = calibrate_stereo(std::move(views), kBoard, kBoardImages, options);
  EXPECT_TRUE(c.ok()) << (c ? "" : c.error().text());
  return c ? c.value() : StereoCalibration{};
}

double turned(const StereoCalibration& c) {
  return Eigen::AngleAxisd(c.rig.T_right_left.linear().transpose() *
                           true_rig().T_right_left.linear())
      .angle();
}

TEST(StereoCalibration, FindsWhatTheViewsWereMadeWithAndSaysHowSurely) {
  const auto c = calibrated(good_views());
  ASSERT_GT(c.views.size(), 25U);
  const RigEstimate truth = true_rig();
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_NEAR(c.rig.left[i] / truth.left[i], 1, 1e-3);
    EXPECT_NEAR(c.rig.right[i] / truth.right[i], 1, 1e-3);
  }
  EXPECT_NEAR(c.rig.baseline_m(), truth.baseline_m(), 2e-4);
  EXPECT_LT(turned(c), 0.01 * M_PI / 180);
  EXPECT_NEAR(c.rig.sigma_px, kNoise_px, 0.005);
  // Every number within four of its own sigmas, and the sigmas are of use.
  const auto number = [](const RigEstimate& rig, Eigen::Index n) {
    const auto i = static_cast<std::size_t>(n);
    return i < kLensNumbers ? rig.left[i] : rig.right[i - kLensNumbers];
  };
  for (Eigen::Index n = 0; n < Eigen::Index(2 * kLensNumbers); ++n) {
    const double sigma = std::sqrt(c.rig.covariance(n, n));
    EXPECT_LE(std::abs(number(c.rig, n) - number(truth, n)), 4 * sigma) << n;
  }
  EXPECT_LT(std::abs(c.rig.baseline_m() - truth.baseline_m()), 4 * c.rig.baseline_sigma_m());
  // The floor where this rig and the true one see it.
  const auto off = height_difference(c.rig, truth, kBoardImages, 3);
  for (std::size_t i = 0; i < off.values.size(); ++i)
    EXPECT_LT(off.values[i], 4.5 * c.height_sigma_m.values[i]) << i;
  EXPECT_EQ(c.verdict, CalibrationVerdict::kGood) << testing::PrintToString(c.remarks);
  EXPECT_TRUE(c.rejected.empty());
  EXPECT_GT(c.halves_expected_m, 0);
  EXPECT_LT(c.halves_apart_m, 4 * c.halves_expected_m);
}

TEST(StereoCalibration, RejectsPairsThatWereNotTakenAtTheSameTime) {
  auto places = board_places(kBoard, 80, 0.8);
  auto views = board_views(kBoard, true_rig(), places, kNoise_px);
  for (auto& T : places) T.translation().x() += 0.006;
  const auto later = board_views(kBoard, true_rig(), places, kNoise_px);
  int spoilt = 0;
  for (auto& view : views)
    for (const auto& other : later)
      if (view.name == other.name && !view.left.empty() && !other.right.empty() && spoilt < 6 &&
          !view.right.empty()) {
        view.right = other.right;
        ++spoilt;
      }
  ASSERT_EQ(spoilt, 6);
  const auto c = calibrated(std::move(views));
  ASSERT_EQ(c.rejected.size(), 6U);
  for (const auto& view : c.rejected) EXPECT_THAT(view.reason, HasSubstr("at the same time"));
  EXPECT_NEAR(c.rig.baseline_m(), true_rig().baseline_m(), 2e-4);
  EXPECT_EQ(c.verdict, CalibrationVerdict::kUsable);  // it says that the trigger does not hold
}

TEST(StereoCalibration, NumbersTheRightCornersAsTheLeftOnes) {
  auto views = good_views();
  int turned_round = 0;
  for (std::size_t i = 0; i < views.size(); i += 2)
    if (!views[i].left.empty() && !views[i].right.empty()) {
      std::reverse(views[i].right.pixels.begin(), views[i].right.pixels.end());
      ++turned_round;
    }
  const auto c = calibrated(std::move(views));
  EXPECT_EQ(c.renumbered, turned_round);
  EXPECT_TRUE(c.rejected.empty());
  EXPECT_NEAR(c.rig.baseline_m(), true_rig().baseline_m(), 2e-4);
}

TEST(StereoCalibration, DropsCornersThatAreNotWhereAllOthersSay) {
  auto views = good_views();
  for (std::size_t i = 0; i < views.size(); i += 3)
    if (!views[i].left.empty()) views[i].left.pixels[10] += Eigen::Vector2d(2.5, -1.5);
  const auto c = calibrated(std::move(views));
  EXPECT_GE(c.dropped, 8);
  EXPECT_LT(c.dropped, 25);
  EXPECT_NEAR(c.rig.sigma_px, kNoise_px, 0.01);
}

TEST(StereoCalibration, RejectsAViewOfAnotherThing) {
  auto views = good_views();
  auto& view = *std::find_if(views.begin(), views.end(),
                             [](const View& v) { return !v.left.empty() && !v.right.empty(); });
  std::mt19937 random(1);
  std::normal_distribution<double> wild(0, 12);
  for (auto& p : view.right.pixels) p += Eigen::Vector2d(wild(random), wild(random));
  const std::string name = view.name;
  const auto c = calibrated(std::move(views));
  ASSERT_EQ(c.rejected.size(), 1U);
  EXPECT_EQ(c.rejected[0].name, name);
  EXPECT_THAT(c.rejected[0].reason, HasSubstr("right image"));
}

TEST(StereoCalibration, ReckonsWithABoardThatIsBent) {
  Board bent = kBoard;
  auto places = board_places(kBoard, 80, 0.8);
  std::mt19937 random(5);
  std::vector<View> views;
  const RigEstimate truth = true_rig();
  for (std::size_t i = 0; i < places.size(); ++i) {
    View view{"v" + std::to_string(i), {}, {}};
    std::normal_distribution<double> noise(0, kNoise_px);
    for (const bool right : {false, true}) {
      Corners& eye = right ? view.right : view.left;
      const Eigen::Isometry3d T = right ? truth.T_right_left * places[i] : places[i];
      int id = 0;
      for (Eigen::Vector3d corner : bent.corners()) {
        const double x = 2 * corner.x() / 0.24 - 1;
        corner.z() = 0.002 * (1 - x * x);  // 2 mm in its middle
        const Eigen::Vector3d p = T * corner;
        Eigen::Vector2d pixel;
        project((right ? truth.right : truth.left).data(), p.data(), pixel.data());
        if (pixel.x() < 4 || pixel.y() < 4 || pixel.x() > 1275 || pixel.y() > 715) {
          eye = {};
          break;
        }
        eye.ids.push_back(id++);
        eye.pixels.push_back(pixel + Eigen::Vector2d(noise(random), noise(random)));
      }
    }
    if (!view.left.empty() || !view.right.empty()) views.push_back(view);
  }
  const auto c = calibrated(std::move(views));
  EXPECT_NEAR(c.rig.warp_m.x(), 0.002, 0.0002);
  EXPECT_NEAR(c.rig.left[0] / truth.left[0], 1, 1e-3);
  EXPECT_NEAR(c.rig.baseline_m(), truth.baseline_m(), 2e-4);
}

TEST(StereoCalibration, SaysThatTheSquareWasMeasuredWrong) {
  StereoCalibrationOptions options;
  options.baseline_m = 0.12;
  Board wrong = kBoard;
  wrong.square_m *= 1.1;
  options.floor_m = 3;
  const auto c = calibrate_stereo(good_views(), wrong, kBoardImages, options);
  ASSERT_TRUE(c.ok());
  EXPECT_EQ(c.value().verdict, CalibrationVerdict::kBad);
  EXPECT_THAT(c.value().remarks.front(), HasSubstr("30.0"));
}

TEST(StereoCalibration, SaysThatTheCamerasAreSwapped) {
  auto views = good_views();
  for (auto& view : views) std::swap(view.left, view.right);
  const auto c = calibrated(std::move(views));
  EXPECT_EQ(c.verdict, CalibrationVerdict::kBad);
  EXPECT_THAT(c.remarks.front(), HasSubstr("swapped"));
}

// The board held upright before the camera, again and again: nothing tells focal length from
// distance. A technician's first try.
TEST(StereoCalibration, IsNeverGoodFromABoardThatWasNotTilted) {
  auto c =
      calibrate_stereo(board_views(kBoard, true_rig(), board_places(kBoard, 80, 0.01), kNoise_px),
                       kBoard, kBoardImages, {LensFit::kRadialTangential, 3, {}});
  if (!c) return;
  EXPECT_NE(c.value().verdict, CalibrationVerdict::kGood);
  EXPECT_THAT(c.value().remarks, ::testing::Contains(HasSubstr("tilt the board")));
}

TEST(StereoCalibration, RefusesTooFewViews) {
  const auto c = calibrate_stereo(good_views(4), kBoard, kBoardImages, {});
  ASSERT_FALSE(c.ok());
  EXPECT_THAT(c.error().text(), HasSubstr("views"));
  EXPECT_FALSE(calibrate_stereo({}, kBoard, kBoardImages, {}).ok());
}

TEST(StereoCalibration, AsksForThePartsOfTheImageThatWereNotSeen) {
  auto views = good_views();
  for (View& view : views)
    for (Corners* eye : {&view.left, &view.right})
      if (!eye->empty() && std::any_of(eye->pixels.begin(), eye->pixels.end(),
                                       [](const auto& p) { return p.x() > 900; }))
        *eye = {};
  std::erase_if(views, [](const View& v) { return v.left.empty() && v.right.empty(); });
  const auto c = calibrated(std::move(views));
  EXPECT_THAT(c.remarks, ::testing::Contains(HasSubstr("right edge of the left image")));
}

TEST(CalibrationReport, HoldsTheVerdictAndNamesAsTheyAreText) {
  auto views = good_views();
  views.front().name = "<script>alert(1)</script>";
  auto c = calibrated(std::move(views));
  c.rejected.push_back({"a<b", "no board"});
  const std::string page = report_page(c, "crane & hall", {});
  const auto holds = [&page](const char* text) { return page.find(text) != std::string::npos; };
  EXPECT_TRUE(holds("Good: can be used"));
  EXPECT_TRUE(holds("a&lt;b"));
  EXPECT_TRUE(holds("crane &amp; hall"));
  EXPECT_TRUE(holds("&lt;script"));
  EXPECT_FALSE(holds("<script"));
  EXPECT_FALSE(holds("http:"));
}

TEST(Board, IsReadFromItsText) {
  const auto chess = parse_board("chessboard:9x6:0.025");
  ASSERT_TRUE(chess.ok());
  EXPECT_EQ(chess.value().corners().size(), 54U);
  EXPECT_DOUBLE_EQ(chess.value().corners()[9].y(), 0.025);
  const auto grid = parse_board("aprilgrid:6x6:0.088:0.3");
  ASSERT_TRUE(grid.ok());
  EXPECT_EQ(grid.value().corners().size(), 144U);
  EXPECT_NEAR(grid.value().corners()[4].x(), 0.088 * 1.3, 1e-12);
  EXPECT_TRUE(parse_board("charuco:11x8:0.03:0.022:5X5_100").ok());
}

TEST(Board, SaysWhatIsWrongWithItsText) {
  for (const char* text :
       {"", "chessboard", "chessboard:9x6", "chessboard:9:0.025", "chessboard:9x6:25",
        "chessboard:9x6:-1", "chessboard:9x6:nan", "chessboard:1x6:0.02", "chessboard:900x6:0.02",
        "charuco:11x8:0.03:0.03:5X5_100", "aprilgrid:6x6:0.088:1.2", "circles:9x6:0.02",
        "chessboard:9x6:0.025:0.3", "chessboard:9x6x:0.025"})
    EXPECT_FALSE(parse_board(text).ok()) << text;
}

}  // namespace
}  // namespace crane
