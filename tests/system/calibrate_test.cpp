// SPDX-License-Identifier: Apache-2.0
// `cranemap calibrate stereo` as a technician uses it, right and wrong, on rendered images.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "base/clock.hpp"
#include "recording/calibration.hpp"
#include "recording/image_file.hpp"
#include "system/process.hpp"
#include "temp_folder.hpp"
#include "unit/board_images.hpp"

namespace crane::test {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr double kBaseline_m = 0.12;

/// Images of a board by two cameras side by side, rendered once for all tests.
class Calibrate : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    const Board board = parse_board("chessboard:9x6:0.025").value();
    const Eigen::Vector3d middle = 0.5 * (board.corners().front() + board.corners().back());
    std::mt19937 random(4);
    std::uniform_real_distribution<double> one(-1, 1);
    for (int i = 0; i < 24; ++i) {
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      T.linear() = (Eigen::AngleAxisd(0.7 * one(random), Eigen::Vector3d::UnitX()) *
                    Eigen::AngleAxisd(0.7 * one(random), Eigen::Vector3d::UnitY()))
                       .toRotationMatrix();
      const double z = 0.32 + 0.1 * (one(random) + 1);
      // Around the image, one part after the other.
      const double x = (i % 4 - 1.5) * 0.11 + 0.06;
      const double y = (i / 4 % 3 - 1) * 0.06;
      T.translation() = Eigen::Vector3d(x, y, z) - T.linear() * middle;
      for (const bool right : {false, true}) {
        Eigen::Isometry3d seen = T;
        if (right) seen.translation().x() -= kBaseline_m;
        ASSERT_TRUE(write_image(file(right, i), render(board, seen).image).ok());
      }
    }
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::string file(bool right, int i) {
    return *folder_ / ((right ? "right" : "left") + std::to_string(10 + i) + ".png");
  }
  static Finished calibrate(const std::string& images, const std::string& out,
                            std::vector<std::string> more = {}) {
    std::vector<std::string> command = {"calibrate", "stereo", images, "--height",
                                        "2",         "--out",  out};
    if (std::find(more.begin(), more.end(), "--board") == more.end())
      more.insert(more.end(), {"--board", "chessboard:9x6:0.025"});
    command.insert(command.end(), more.begin(), more.end());
    return run(command, work_.path());
  }

  static TempFolder* folder_;
  inline static TempFolder work_;
};
TempFolder* Calibrate::folder_ = nullptr;

TEST_F(Calibrate, WritesAFolderThatServicesTakeAndAReport) {
  const std::string out = work_ / "good";
  const Finished done = calibrate(folder_->path(), out, {"--baseline", "0.12"});
  ASSERT_EQ(done.code, 0) << done.output;
  const auto rig = read_rig(out);
  ASSERT_TRUE(rig.ok()) << rig.error().text();
  EXPECT_NEAR(rig.value().baseline_m(), kBaseline_m, 2e-4);
  EXPECT_NEAR(rig.value().left.fx_px / kF_px, 1, 2e-3);
  EXPECT_NEAR(rig.value().camera_height_m(), 2, 1e-9);
  EXPECT_GT(fs::file_size(out + "/report.html"), 20'000U);
  EXPECT_THAT(done.output, HasSubstr("baseline 1"));
  // Never over a calibration that is there.
  EXPECT_EQ(calibrate(folder_->path(), out).code, 2);
}

TEST_F(Calibrate, SaysWhatATechnicianDidWrong) {
  const auto expect = [](const Finished& done, int code, const std::string& text) {
    EXPECT_EQ(done.code, code) << done.output;
    EXPECT_THAT(done.output, HasSubstr(text));
  };
  // Squares counted, not corners.
  expect(calibrate(folder_->path(), work_ / "a", {"--board", "chessboard:10x7:0.025"}), 2, "9x6");
  // Squares measured wrong by 10 %.
  expect(calibrate(folder_->path(), work_ / "b",
                   {"--board", "chessboard:9x6:0.0275", "--baseline", "0.12"}),
         2, "25.0");
  EXPECT_FALSE(fs::exists(work_ / "b/cam0"));
  // Left and right swapped.
  const TempFolder swapped;
  const TempFolder capped;
  const Image black{kWidth, kHeight, 1, std::vector<std::uint8_t>(kWidth * kHeight, 3)};
  for (int i = 0; i < 24; ++i) {
    const std::string name = std::to_string(10 + i) + ".png";
    fs::copy_file(file(false, i), swapped / ("right" + name));
    fs::copy_file(file(true, i), swapped / ("left" + name));
    fs::copy_file(file(false, i), capped / ("left" + name));
    ASSERT_TRUE(write_image(capped / ("right" + name), black).ok());
  }
  expect(calibrate(swapped.path(), work_ / "c"), 2, "swapped");
  // Lens cap.
  expect(calibrate(capped.path(), work_ / "d"), 2, "right camera");
  // Nothing there, and nothing to read.
  expect(calibrate(work_ / "nowhere", work_ / "e"), 2, "no such folder");
  const TempFolder empty;
  expect(calibrate(empty.path(), work_ / "f"), 2, "no image pairs");
  std::ofstream(empty / "left1.png") << "not an image";
  expect(calibrate(empty.path(), work_ / "g"), 2, "in none of the images");
  expect(calibrate(folder_->path(), work_ / "h", {"--board", "chessboard:9x6:25"}), 2,
         "millimetres");
}

TEST_F(Calibrate, ARunningCameraIsLookedAtAndThePersonToldWhatToShowNext) {
  const TempFolder folder;
  for (const char* side : {"left", "right"})
    fs::create_directories(folder / ("in/" + std::string(side)));
  std::ofstream(folder / "site.yaml") << "camera: {source: folder, path: " << folder / "in"
                                      << "}\n";
  Process live({"cranemap", "calibrate", "stereo", "--live", folder / "site.yaml", "--board",
                "chessboard:9x6:0.025", "--height", "2", "--out", folder / "out"},
               folder / "live.txt");
  ASSERT_TRUE(eventually(20s, [&] { return live.output().find("looking for") < 999; }));
  std::int64_t time = SystemClock().now();
  const auto show = [&](int i, const std::string& said) {
    return eventually(20s, [&] {
      for (const bool right : {true, false}) {
        const std::string side = right ? "right" : "left";
        const std::string name = std::to_string(time) + ".png";
        fs::copy_file(file(right, i), folder / ("in/." + name));
        fs::rename(folder / ("in/." + name), folder / ("in/" + side + "/" + name));
      }
      time += 250'000'000;
      std::this_thread::sleep_for(250ms);
      return live.output().find(said) != std::string::npos;
    });
  };
  EXPECT_TRUE(show(5, "view 1 kept; next: hold the board in the")) << live.output();
  EXPECT_TRUE(show(5, "not kept: as view 1")) << live.output();
  EXPECT_TRUE(show(10, "the board moves")) << live.output();
  EXPECT_TRUE(show(10, "view 2 kept")) << live.output();
  live.signal(SIGINT);
  EXPECT_EQ(live.wait(20), 3) << live.output();
  EXPECT_THAT(live.output(), HasSubstr("give the folder instead of --live"));
  for (const char* image : {"left01.png", "right01.png", "left02.png", "right02.png"})
    EXPECT_TRUE(fs::exists(folder / ("out/images/" + std::string(image)))) << image;
}

}  // namespace
}  // namespace crane::test
