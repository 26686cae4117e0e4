// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "motion/align.hpp"
#include "motion/key_frames.hpp"
#include "motion/motion_stereo.hpp"
#include "motion/sweep_cells.hpp"

namespace crane {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFocal = 260, kHeightM = 9, kBoxM = 1.5;

/// Without a period anywhere: waves of many directions.
double texture(double x, double y) {
  double sum = 0;
  for (int i = 1; i <= 14; ++i) {
    const double angle = 2.399963 * i, k = 4 + 1.37 * i;
    sum += std::sin(k * (std::cos(angle) * x + std::sin(angle) * y) + 1.7 * i * i);
  }
  return 120 + 9 * sum;
}

double checker(double x, double y) {
  const auto odd = [](double v) { return (int(std::floor(v)) & 1) != 0; };
  return odd(x / 0.5) != odd(y / 0.5) ? 150 : 90;
}

using Floor = std::function<double(double x, double y)>;

struct View {
  std::vector<std::uint8_t> bgr;
  std::vector<float> depth;
  std::vector<std::uint8_t> confidence;
  DepthFrame frame;
  PlacedImage image;

  void fix() {
    frame.depth_m = depth.data();
    frame.confidence = confidence.data();
    frame.colour = bgr.data();
  }
};

/// A floor 9 m below with a box of 1.5 m on it, x in [-1, 1], y in [-0.8, 0.7], from (x, y).
View view_from(double x, double y, const Floor& floor, unsigned seed, double shift_m = 0) {
  View v;
  v.bgr.resize(3 * kWidth * kHeight);
  v.depth.resize(kWidth * kHeight);
  v.confidence.assign(kWidth * kHeight, 255);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1.5);
  constexpr int kSamples = 3;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      double sum = 0;
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const double u = column + (s % kSamples - 1) / double(kSamples);
        const double w = row + (s / kSamples - 1) / double(kSamples);
        const double rx = (u - 159.5) / kFocal, ry = -(w - 119.5) / kFocal;
        double z = kHeightM - kBoxM;
        double px = x + rx * z, py = y + ry * z;
        const bool box = px > -1 && px < 1 && py > -0.8 && py < 0.7;
        if (!box) z = kHeightM, px = x + rx * z, py = y + ry * z;
        sum += box ? texture(px + 31 + shift_m, py - 17) : floor(px, py);
        if (s == kSamples * kSamples / 2) v.depth[std::size_t(row * kWidth + column)] = float(z);
      }
      const double grey = sum / (kSamples * kSamples) + noise(random);
      for (int c = 0; c < 3; ++c)
        v.bgr[std::size_t(3 * (row * kWidth + column) + c)] =
            std::uint8_t(std::clamp(grey, 0.0, 255.0));
    }
  v.frame.width = kWidth;
  v.frame.height = kHeight;
  v.frame.f_px = kFocal;
  v.frame.cx_px = 159.5;
  v.frame.cy_px = 119.5;
  v.frame.baseline_m = 0.5;
  v.frame.sigma_disparity_px = 0.05;
  v.frame.T_map_rectified.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  v.frame.T_map_rectified.translation() = Eigen::Vector3d(x, y, kHeightM);
  v.fix();
  v.image = placed_image(v.frame, 0);
  return v;
}

/// Says that the view was taken somewhere else.
void misplace(View& v, double x, double y) {
  v.frame.T_map_rectified.translation() += Eigen::Vector3d(x, y, 0);
  v.image.T_map_rectified = v.frame.T_map_rectified;
}

TEST(Align, FindsHowTwoFramesReallyLieToAFractionOfAPixel) {
  const View other = view_from(0, 0, texture, 1);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.6, 0), Eigen::Vector2d(0.1, -0.5)}) {
    View v = view_from(at.x(), at.y(), texture, 2);
    misplace(v, 0.04, -0.03);  // a pixel is 35 mm
    v.fix();
    const auto found = align(v.frame, v.image, other.image);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->displacement_m.x(), at.x(), 0.002);
    EXPECT_NEAR(found->displacement_m.y(), at.y(), 0.002);
    EXPECT_NEAR(found->correction_m.x(), -0.04, 0.002);
    EXPECT_NEAR(found->correction_m.y(), 0.03, 0.002);
    EXPECT_GT(found->support, 0.7);
    EXPECT_LT(found->sigma_m, 0.01);
    const Eigen::Vector2d error = found->displacement_m - at;
    EXPECT_LT(error.dot(found->covariance_m2.inverse() * error), 16) << "4 sigma";
  }
}

TEST(Align, FarOffNeedsTheSearch) {
  const View other = view_from(0, 0, texture, 1);
  View v = view_from(0.5, 0.2, texture, 2);
  misplace(v, 0.9, -0.5);  // 26 and 14 px
  v.fix();
  const auto found = align(v.frame, v.image, other.image, {1.2});
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->ambiguous);
  EXPECT_NEAR(found->displacement_m.x(), 0.5, 0.002);
  EXPECT_NEAR(found->displacement_m.y(), 0.2, 0.002);
}

TEST(Align, WhatMovedByItselfDoesNotTell) {
  const View other = view_from(0, 0, texture, 1);
  const View v = view_from(0.4, 0, texture, 2, 0.05);  // the box went 5 cm
  const auto found = align(v.frame, v.image, other.image);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->correction_m.norm(), 0, 0.004);
}

TEST(Align, SaysThatAPatternFitsElsewhere) {
  const View other = view_from(-3, 0, checker, 1);  // hardly a box
  const View v = view_from(-3.2, 0, checker, 2);
  const auto found = align(v.frame, v.image, other.image, {1.2});
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->ambiguous);
}

TEST(Align, WithoutTextureOrWithoutDepthThereIsNothingToTell) {
  const View textured = view_from(0, 0, texture, 1);
  View bare = view_from(
      0.2, 0, [](double, double) { return 120; }, 2);
  std::fill(bare.bgr.begin(), bare.bgr.end(), std::uint8_t{120});
  bare.image = placed_image(bare.frame, 0);
  EXPECT_FALSE(align(bare.frame, bare.image, textured.image));
  View blind = view_from(0.2, 0, texture, 2);
  std::fill(blind.depth.begin(), blind.depth.end(), 0.0F);
  EXPECT_FALSE(align(blind.frame, blind.image, textured.image));
  View unrelated = view_from(
      0.2, 0, [](double x, double y) { return texture(y + 50, 7 - x); }, 2);
  EXPECT_FALSE(align(unrelated.frame, unrelated.image, textured.image));
}

PlacedImage taken_at(double x, double seconds) {
  PlacedImage image;
  image.full = {4, 2, std::vector<std::uint8_t>(8)};
  image.half = {2, 1, std::vector<std::uint8_t>(2)};
  image.f_px = 100;
  image.T_map_rectified.translation().x() = x;
  image.exposure = TimeNs(seconds * 1e9) + 1;
  return image;
}

TEST(KeyFrames, AreSpreadOverTheWayAndBounded) {
  KeyFrames frames({4, 0.3, 60 * kNsPerSecond});
  for (int i = 0; i < 100; ++i) frames.add(taken_at(0.05 * i, 0.1 * i));
  ASSERT_EQ(frames.all().size(), 4U);
  for (std::size_t i = 0; i + 1 < 4; ++i)
    EXPECT_GE(frames.all()[i]->T_map_rectified.translation().x(),
              frames.all()[i + 1]->T_map_rectified.translation().x() + 0.29);
  EXPECT_LT(frames.memory_bytes(), 4 * (sizeof(PlacedImage) + 64));
}

TEST(KeyFrames, StandingStillKeepsWhatThereIs) {
  KeyFrames frames({4, 0.3, 60 * kNsPerSecond});
  for (int i = 0; i < 4; ++i) frames.add(taken_at(i, i));
  for (int i = 0; i < 300; ++i) frames.add(taken_at(3.01, 4 + 0.1 * i));
  EXPECT_EQ(frames.all().size(), 4U);
  frames.add(taken_at(3, 100));
  EXPECT_EQ(frames.all().size(), 1U) << "the others are too old";
}

TEST(KeyFrames, AnEarlierTimeOrAnotherCameraBeginsAnew) {
  KeyFrames frames({4, 0.3, 60 * kNsPerSecond});
  frames.add(taken_at(0, 10));
  frames.add(taken_at(1, 11));
  frames.add(taken_at(2, 1));
  EXPECT_EQ(frames.all().size(), 1U);
  PlacedImage turned = taken_at(3, 2);
  turned.T_map_rectified.linear() = Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitZ()).matrix();
  frames.add(turned);
  EXPECT_EQ(frames.all().size(), 1U);
}

TEST(SweepCell, FastIsAsSlow) {
  constexpr int kEdge = 70;
  std::mt19937 random(5);
  std::vector<std::uint8_t> a(kEdge * kEdge), b(kEdge * kEdge);
  for (auto* image : {&a, &b})
    for (auto& p : *image) p = static_cast<std::uint8_t>(random());
  std::fill(b.begin(), b.begin() + 16 * kEdge, std::uint8_t{255});
  std::fill(a.begin(), a.begin() + 16 * kEdge, std::uint8_t{0});
  std::vector<std::int32_t> offsets = {-1, 0};
  for (int i = 0; i < 200; ++i)
    offsets.push_back(std::int32_t(random() % (kEdge - 15)) * kEdge +
                      std::int32_t(random() % (kEdge - 15)));
  std::vector<std::uint16_t> fast(offsets.size()), slow(offsets.size());
  for (const int at : {0, 3 * kEdge + 5, (kEdge - 16) * kEdge + kEdge - 16}) {
    const SweepCell cell{a.data() + at, kEdge,          b.data(),
                         kEdge,         offsets.data(), int(offsets.size())};
    sweep_cell(cell, fast.data());
    sweep_cell_slow(cell, slow.data());
    EXPECT_EQ(fast, slow);
    EXPECT_EQ(fast[0], kNotVisible);
  }
}

/// What the pair leaves on a pattern: the box has depth, the floor none.
void forget_floor(View& v) {
  for (float& z : v.depth)
    if (z > kHeightM - kBoxM / 2) z = 0;
}

struct Filled {
  int matched = 0, wrong = 0;
};
Filled filled_in(const View& v, const View& before) {
  Filled out;
  for (std::size_t i = 0; i < v.depth.size(); ++i) {
    if (before.depth[i] != 0 || v.depth[i] == 0) continue;
    ++out.matched;
    out.wrong += std::abs(std::abs(v.depth[i]) - kHeightM) > 0.15 ? 1 : 0;
  }
  return out;
}

/// What the pair says of a pattern: everywhere a depth that is wrong by one period.
std::vector<float> one_period_off(const View& v, double period_px) {
  std::vector<float> out(v.depth.size());
  const double fb = kFocal * v.frame.baseline_m;
  for (std::size_t i = 0; i < out.size(); ++i)
    if (v.depth[i] == 0) out[i] = float(fb / (fb / kHeightM + period_px));
  return out;
}

/// Drives over a floor of tiles that are all alike; what the last frame got.
/// `matched`: with what the pair says of it, else all depths are tried.
Filled drive(const std::vector<Eigen::Vector3d>& places_and_times, bool matched = false,
             const Floor& floor = checker) {
  MotionStereo motion;
  Filled out;
  for (const Eigen::Vector3d& at : places_and_times) {
    View v = view_from(at.x(), at.y(), floor, unsigned(at.z() * 10));
    forget_floor(v);
    const View before = v;
    v.fix();
    constexpr double kPeriod_px = kFocal / kHeightM;  // 1 m
    motion.improve(v.frame, TimeNs(at.z() * 1e9) + 1, v.depth, v.confidence,
                   matched ? one_period_off(v, kPeriod_px) : std::vector<float>());
    out = filled_in(v, before);
  }
  return out;
}

TEST(MotionStereo, ResolvesAPatternWhoseTilesAreAllAlike) {
  const Filled f =
      drive({{0, 0, 0}, {0.83, 0.1, 3}, {0.3, 0.91, 6}, {1.37, 0.62, 9}, {0.7, 0.35, 12}});
  EXPECT_GT(f.matched, 3000);
  EXPECT_LT(f.wrong, f.matched / 200);
}

TEST(MotionStereo, TakesAMatchOnAPatternForOneOfSeveral) {
  // In short time: a fifth of the cells could be tried at all depths.
  const std::vector<Eigen::Vector3d> way = {
      {0, 0, 0}, {0.83, 0.1, 0.1}, {0.3, 0.91, 0.2}, {1.37, 0.62, 0.3}, {0.7, 0.35, 0.4}};
  const Filled without = drive(way), with = drive(way, true);
  EXPECT_GT(with.matched, 3 * without.matched);
  EXPECT_GT(with.matched, 20000);
  EXPECT_LT(with.wrong, with.matched / 200);
}

TEST(MotionStereo, AMatchWhereHardlyAnythingIsSeenTellsNoMoreThanNone) {
  const std::vector<Eigen::Vector3d> way = {
      {0, 0, 0}, {0.83, 0.1, 3}, {0.3, 0.91, 6}, {1.37, 0.62, 9}, {0.7, 0.35, 12}};
  for (const double contrast : {0.0, 0.06, 0.08}) {
    const auto dull = [&](double x, double y) { return 120 + contrast * (texture(x, y) - 120); };
    const Filled without = drive(way, false, dull), with = drive(way, true, dull);
    EXPECT_LE(with.wrong, without.wrong + 12) << "contrast " << contrast;
  }
}

TEST(MotionStereo, AMatchOnAPatternThatAllViewsBearOutElsewhereStaysUnknown) {
  // Steps of whole periods, and what could move by itself.
  const Filled same =
      drive({{0, 0, 0}, {1, 0, 3}, {1, 1, 6}, {0, 1, 9}, {2, 0, 12}, {0, 0, 15}}, true);
  EXPECT_LT(same.wrong, 50) << "of " << same.matched;
  const Filled steady =
      drive({{0, 0, 0}, {0.31, 0.22, 3}, {0.62, 0.44, 6}, {0.93, 0.66, 9}, {1.24, 0.88, 12}}, true);
  EXPECT_EQ(steady.matched, 0);
}

TEST(MotionStereo, FindsNothingOnADriveThatASteadyMoverCouldMimic) {
  const Filled f =
      drive({{0, 0, 0}, {0.31, 0.22, 3}, {0.62, 0.44, 6}, {0.93, 0.66, 9}, {1.24, 0.88, 12}});
  EXPECT_EQ(f.matched, 0);
}

TEST(MotionStereo, StandingStillNothingChanges) {
  const Filled f = drive({{0, 0, 0}, {0, 0, 3}, {0.01, 0, 6}, {0, 0.01, 9}, {0, 0, 12}});
  EXPECT_EQ(f.matched, 0);
}

TEST(MotionStereo, AFloorThatFitsAtSeveralDepthsInAllViewsHasNone) {
  // Steps of two tiles: every view sees the same.
  const Filled f = drive({{0, 0, 0}, {1, 0, 3}, {1, 1, 6}, {0, 1, 9}, {2, 0, 12}, {0, 0, 15}});
  EXPECT_LT(f.wrong, 50) << "of " << f.matched;
}

TEST(MotionStereo, WithoutColourOrWithWrongPositionsThePairStandsAlone) {
  MotionStereo motion;
  View v = view_from(0, 0, texture, 1);
  const View before = v;
  v.fix();
  v.frame.colour = nullptr;
  EXPECT_EQ(motion.improve(v.frame, 1, v.depth, v.confidence).views, 0U);
  EXPECT_EQ(v.depth, before.depth);
  std::size_t misplaced = 0;
  for (int i = 0; i < 4; ++i) {
    View w = view_from(0.4 * i, 0.13 * i * i, texture, unsigned(i));
    const View clean = w;
    if (i == 3) misplace(w, 0.4, 0);  // a third of a metre and more
    w.fix();
    const MotionReport report =
        motion.improve(w.frame, TimeNs(i) * 3 * kNsPerSecond + 2, w.depth, w.confidence);
    misplaced = report.misplaced;
    EXPECT_EQ(w.depth, clean.depth);
  }
  EXPECT_GE(misplaced, 2U);
}

TEST(MotionStereo, HalvesTheErrorOfAShortBaselineAtLeast) {
  MotionStereo motion;
  double before = 0, after = 0;
  std::size_t refined = 0;
  for (int i = 0; i < 4; ++i) {
    View v = view_from(0.45 * i, 0.2 * i, texture, unsigned(i));
    const View truth = v;
    v.frame.baseline_m = 0.12;
    for (std::size_t k = 0; k < v.depth.size(); ++k)
      v.depth[k] *= float(1 + 0.015 * std::sin(double(k % kWidth) / 35 + double(k / kWidth) / 41));
    const View spoiled = v;
    v.fix();
    refined = motion.improve(v.frame, TimeNs(i) * kNsPerSecond + 1, v.depth, v.confidence).refined;
    before = after = 0;
    for (std::size_t k = 0; k < v.depth.size(); ++k) {
      if (v.depth[k] == spoiled.depth[k]) continue;
      before += std::pow(spoiled.depth[k] - truth.depth[k], 2);
      after += std::pow(v.depth[k] - truth.depth[k], 2);
    }
  }
  EXPECT_GT(refined, std::size_t(kWidth * kHeight / 2));
  EXPECT_LT(std::sqrt(after), 0.5 * std::sqrt(before));
}

/// Frames of two drives: over tiles that are all alike, and with a baseline that is short.
std::vector<View> frames_of(bool short_baseline) {
  std::vector<View> out;
  const double places[5][2] = {{0, 0}, {0.83, 0.1}, {0.3, 0.91}, {1.37, 0.62}, {0.7, 0.35}};
  for (const auto& [x, y] : places) {
    out.push_back(view_from(x, y, short_baseline ? texture : checker, unsigned(out.size())));
    if (short_baseline)
      out.back().frame.baseline_m = 0.12;
    else
      forget_floor(out.back());
  }
  return out;
}

/// What becomes of all their depths and confidences.
std::pair<std::vector<float>, std::vector<std::uint8_t>> driven_on(int threads,
                                                                   const std::vector<View>& frames,
                                                                   std::size_t& changed) {
  std::pair<std::vector<float>, std::vector<std::uint8_t>> out;
  MotionStereo motion(threads);
  TimeNs time = 1;
  for (View v : frames) {
    v.fix();
    const MotionReport report =
        motion.improve(v.frame, time += 3 * kNsPerSecond, v.depth, v.confidence);
    changed += report.refined + report.proven;
    out.first.insert(out.first.end(), v.depth.begin(), v.depth.end());
    out.second.insert(out.second.end(), v.confidence.begin(), v.confidence.end());
  }
  return out;
}

TEST(MotionStereo, IsTheSameOnAnyNumberOfThreads) {
  for (const bool short_baseline : {false, true}) {
    const std::vector<View> frames = frames_of(short_baseline);
    std::size_t changed = 0;
    const auto alone = driven_on(1, frames, changed);
    EXPECT_GT(changed, 3000U);
    for (const int threads : {2, 3, 8})
      EXPECT_EQ(driven_on(threads, frames, changed), alone) << threads << " threads";
  }
}

}  // namespace
}  // namespace crane
