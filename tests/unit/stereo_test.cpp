// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "recording/image_file.hpp"
#include "recording/recording.hpp"
#include "recording/truth.hpp"
#include "stereo/disparity_support.hpp"
#include "stereo/semi_global.hpp"
#include "stereo/stereo_stage.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

constexpr std::size_t kPixels = 1280 * 720;

TEST(PaperDisparities, FollowEquationTen) {
  EXPECT_EQ(paper_disparities(1280), 160);
  EXPECT_EQ(paper_disparities(640), 80);
  EXPECT_EQ(paper_disparities(1288), 176);
}

ImageView grey(const std::vector<std::uint8_t>& bytes, std::uint32_t width, std::uint32_t height) {
  return {PixelFormat::kMono8, width, height, bytes};
}

struct Matched {
  std::vector<float> depth = std::vector<float>(kPixels);
  std::vector<std::uint8_t> confidence = std::vector<std::uint8_t>(kPixels);
  std::vector<std::uint8_t> colour = std::vector<std::uint8_t>(3 * kPixels);
};

Result<StereoReport> match_first_frame(const StereoSettings& settings, Matched& out) {
  const auto recording = Recording::open(test::rig_recording());
  auto stage = StereoStage::create(recording->rig(), settings);
  if (!stage) return stage.error();
  const auto left = read_image(recording->frames()[0].left_file, kPixels);
  const auto right = read_image(recording->frames()[0].right_file, kPixels);
  const auto rectified = stage->rectify({left->view(), right->view()});
  if (!rectified) return rectified.error();
  return stage->match({out.depth, out.confidence, out.colour});
}

/// Share of matched pixels whose depth is off by more than one pixel of disparity.
double share_bad(const Matched& m) {
  // The true depth of the left image, in millimetres: same file format as the height map's picture.
  const test::TempFolder folder;
  std::filesystem::copy_file(test::rig_recording() + "/truth/depth0/1700000000000000000.png",
                             folder / "d.png");
  std::ofstream(folder / "d.yaml") << "cell_m: 1\norigin_m: [0, 0]\nsize: [1280, 720]\n";
  const auto truth = read_height_map(folder / "d.png");
  std::size_t bad = 0, matched = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    if (m.depth[i] <= 0) continue;
    ++matched;
    const double true_px = 84.0 / (truth->height_mm[i] * 1e-3);
    bad += std::abs(84.0 / m.depth[i] - true_px) > 1 ? 1 : 0;
  }
  return double(bad) / double(matched);
}

TEST(StereoStage, BoundedSearchSeesTheRigDenselyAndRightly) {
  Matched m;
  const auto report = match_first_frame({}, m);
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_GT(report->matched, 0.80 * kPixels);
  EXPECT_LT(share_bad(m), 0.002);
}

TEST(StereoStage, PaperPresetAndSemiGlobalMatchingWorkToo) {
  Matched paper;
  StereoSettings settings;
  settings.paper = true;
  const auto report = match_first_frame(settings, paper);
  ASSERT_TRUE(report);
  EXPECT_GT(report->matched, 0.8 * kPixels);
  EXPECT_LT(share_bad(paper), 0.005);
  Matched sgbm;
  settings = {};
  settings.matcher = StereoSettings::Matcher::kSgbm;
  ASSERT_TRUE(match_first_frame(settings, sgbm));
  EXPECT_LT(share_bad(sgbm), 0.01);
}

TEST(StereoStage, RefusesImagesOfAnotherSizeThanTheCalibration) {
  const auto recording = Recording::open(test::rig_recording());
  auto stage = StereoStage::create(recording->rig(), {});
  Matched m;
  const std::vector<std::uint8_t> small(640 * 480);
  const auto rectified = stage->rectify({grey(small, 640, 480), grey(small, 640, 480)});
  ASSERT_FALSE(rectified);
  EXPECT_EQ(rectified.error().code, ErrorCode::kWrongSize);
}

TEST(StereoStage, RefusesAnImpossibleSearchRange) {
  const auto recording = Recording::open(test::rig_recording());
  StereoSettings settings;
  settings.nearest_m = 0.05;
  EXPECT_FALSE(StereoStage::create(recording->rig(), settings));
  settings.nearest_m = 3;
  settings.farthest_m = 2;
  EXPECT_FALSE(StereoStage::create(recording->rig(), settings));
}

TEST(StereoStage, ABlackPairIsNoMatchAtAll) {
  const auto recording = Recording::open(test::rig_recording());
  auto stage = StereoStage::create(recording->rig(), {});
  Matched m;
  const std::vector<std::uint8_t> black(kPixels);
  ASSERT_TRUE(stage->rectify({grey(black, 1280, 720), grey(black, 1280, 720)}));
  const auto report = stage->match({m.depth, m.confidence, {}});
  ASSERT_TRUE(report);
  EXPECT_EQ(report->matched, 0U);
}

TEST(DisparitySupport, AnIsolatedMismatchHasNone) {
  std::vector<std::int16_t> disparity(64 * 64, 40 * kDisparityScale);
  disparity[32 * 64 + 32] = 90 * kDisparityScale;
  std::vector<std::uint8_t> confidence(64 * 64);
  disparity_support(disparity, 64, 64, 1, confidence);
  EXPECT_LE(confidence[32 * 64 + 32], 1);
  EXPECT_GT(confidence[20 * 64 + 20], 240);
}

}  // namespace
}  // namespace crane
