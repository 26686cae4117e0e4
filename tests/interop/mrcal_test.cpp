// SPDX-License-Identifier: Apache-2.0
// mrcal (NASA/JPL), an independent calibration, on the same corners: both must agree within what
// they say of their own uncertainty.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>

#include "calibration/stereo_calibration.hpp"
#include "calibration_files/calibration_files.hpp"
#include "temp_folder.hpp"
#include "unit/board_views.hpp"

namespace crane {
namespace {

const Board kBoard{Board::Kind::kChessboard, 9, 6, 0.03, 0, ""};

/// Corners as mrgingham writes them: file name, x, y, level of the pyramid.
void write_corners(const std::vector<View>& views, const std::string& path) {
  std::ofstream out(path);
  out.precision(10);
  out << "# filename x y level\n";
  for (std::size_t v = 0; v < views.size(); ++v)
    for (const bool right : {false, true}) {
      const std::string name = (right ? "right" : "left") + std::to_string(100 + v) + ".png";
      const Corners& eye = right ? views[v].right : views[v].left;
      if (eye.empty()) out << name << " - - -\n";
      for (const auto& p : eye.pixels) out << name << " " << p.x() << " " << p.y() << " 0\n";
    }
}

/// The numbers of a list in a .cameramodel.
std::vector<double> numbers(const std::string& path, const std::string& key) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  const std::string all = text.str();
  std::smatch found;
  if (!std::regex_search(all, found, std::regex("'" + key + "': *\\[([^\\]]*)\\]"))) return {};
  std::string list = found[1];
  std::replace(list.begin(), list.end(), ',', ' ');
  std::stringstream in(list);
  std::vector<double> out;
  for (double number = 0; in >> number;) out.push_back(number);
  return out;
}

TEST(Mrcal, FindsTheSameCamerasFromTheSameCorners) {
  if (std::system("command -v mrcal-calibrate-cameras > /dev/null") != 0)
    GTEST_SKIP() << "mrcal is not installed (deploy/install-deps does)";
  const auto views =
      test::board_views(kBoard, test::true_rig(), test::board_places(kBoard, 50, 0.8), 0.15);
  const auto ours = calibrate_stereo(views, kBoard, test::kBoardImages, {});
  ASSERT_TRUE(ours.ok());
  const RigEstimate& rig = ours.value().rig;

  const test::TempFolder folder;
  write_corners(views, folder / "corners.vnl");
  const std::string command =
      "cd " + folder.path().string() +
      " && timeout 120 mrcal-calibrate-cameras --corners-cache corners.vnl --lensmodel "
      "LENSMODEL_OPENCV4 --focal 700 --imagersize 1280 720 --object-spacing 0.03 "
      "--object-width-n 9 --object-height-n 6 --skip-regularization --jobs 1 --outdir . "
      "'left*.png' 'right*.png' > log 2>&1";
  std::ifstream log(folder / "log");
  ASSERT_EQ(std::system(command.c_str()), 0) << log.rdbuf();

  for (const bool right : {false, true}) {
    const auto theirs =
        numbers(folder / (right ? "camera-1.cameramodel" : "camera-0.cameramodel"), "intrinsics");
    ASSERT_EQ(theirs.size(), 8U);
    const auto& mine = right ? rig.right : rig.left;
    for (std::size_t i = 0; i < 8; ++i) {
      const auto n = static_cast<Eigen::Index>(i + (right ? kLensNumbers : 0));
      const double sigma = std::sqrt(rig.covariance(n, n));
      // From the same corners both should come to nearly the same; a sigma is what the corners'
      // noise would do.
      EXPECT_LT(std::abs(mine[i] - theirs[i]), sigma) << (right ? "right " : "left ") << i;
    }
  }
  const auto place = numbers(folder / "camera-1.cameramodel", "extrinsics");
  ASSERT_EQ(place.size(), 6U);
  const Eigen::Vector3d shift(place[3], place[4], place[5]);
  EXPECT_LT((shift - rig.T_right_left.translation()).norm(), 2 * rig.baseline_sigma_m());
  EXPECT_NEAR(shift.norm(), test::true_rig().baseline_m(), 2e-4);

  // The files as mrcal writes them, with all that they were optimised from, are read as they mean.
  const auto read = read_calibration(
      {folder / "camera-0.cameramodel", folder / "camera-1.cameramodel"}, std::nullopt, {});
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->format, CalibrationFormat::kMrcal);
  const Eigen::Isometry3d T = read->rig.T_right_left();
  EXPECT_LT((T.translation() - rig.T_right_left.translation()).norm(), 2 * rig.baseline_sigma_m());
  EXPECT_LT(Eigen::AngleAxisd(T.linear().transpose() * rig.T_right_left.linear()).angle(), 2e-4);
  EXPECT_EQ(read->rig.right.fx_px, numbers(folder / "camera-1.cameramodel", "intrinsics").front());
}

}  // namespace
}  // namespace crane
