// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "stereo/evidence.hpp"
#include "stereo/repetition.hpp"

namespace crane {
namespace {

constexpr int kWidth = 320, kHeight = 128;
constexpr int kFloor_px = 40;

/// A floor with random texture at one disparity, seen by both cameras, with something thin painted
/// over it that stands nearer.
struct Pair {
  std::vector<std::uint8_t> left, right;
  std::vector<std::int16_t> disparity;
  std::vector<std::uint8_t> confidence;

  explicit Pair(double noise = 1.5) {
    std::mt19937 random(5);
    std::normal_distribution<double> grain(0, noise);
    std::vector<float> rough(std::size_t(kWidth + 200) * kHeight);
    for (float& v : rough) v = float(random() % 200);
    const auto smooth = [&](int x, int y) {  // blobs of some five pixels
      float sum = 0;
      int n = 0;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
          const int v = std::clamp(y + dy, 0, kHeight - 1);
          const int u = std::clamp(x + dx, 0, kWidth + 199);
          sum += rough[std::size_t(v) * (kWidth + 200) + std::size_t(u)];
          ++n;
        }
      return 100 + 2 * (sum / float(n) - 100);
    };
    const auto pixel = [&](float v) {
      return static_cast<std::uint8_t>(std::clamp(std::lround(v + grain(random)), 0L, 255L));
    };
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        left.push_back(pixel(smooth(x, y)));
        right.push_back(pixel(smooth(x + kFloor_px, y)));
      }
    disparity.assign(left.size(), kFloor_px * kDisparityScale);
    confidence.assign(left.size(), 200);
  }
  /// Paints the same thing in both images, `disparity_px` apart.
  void paint(int x0, int y0, int x1, int y1, int disparity_px, std::uint8_t grey) {
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        left[std::size_t(y) * kWidth + std::size_t(x)] = grey;
        if (x >= disparity_px)
          right[std::size_t(y) * kWidth + std::size_t(x - disparity_px)] = grey;
      }
  }
  EvidenceReport look() {
    return Evidence().keep_proven({left.data(), kWidth, kHeight, kWidth},
                                  {right.data(), kWidth, kHeight, kWidth}, disparity, confidence);
  }
  /// Share of a part of the image whose match is still there.
  [[nodiscard]] double kept(int x0, int y0, int x1, int y1) const {
    int n = 0;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) n += disparity[std::size_t(y) * kWidth + std::size_t(x)] > 0;
    return double(n) / double((x1 - x0) * (y1 - y0));
  }
};

TEST(Evidence, KeepsNearlyAllMatchesThatAreTrue) {
  for (double noise : {0.5, 1.5, 3.0}) {
    Pair pair(noise);
    pair.look();
    EXPECT_GT(pair.kept(60, 2, 310, 126), noise < 2 ? 0.93 : 0.9) << noise;
  }
}

TEST(Evidence, DropsWhatTheRightImageDoesNotBearOut) {
  Pair pair;
  for (int y = 40; y < 60; ++y)
    for (int x = 100; x < 180; ++x)
      pair.disparity[std::size_t(y) * kWidth + std::size_t(x)] = (kFloor_px + 6) * kDisparityScale;
  const EvidenceReport report = pair.look();
  EXPECT_LT(pair.kept(106, 42, 174, 58), 0.02);
  EXPECT_GT(report.unexplained, 800U);
}

TEST(Evidence, AThinThingGivenTheFloorsDisparityProvesNothing) {
  // One to six pixels thick, along and across the baseline, brighter and darker: what a matcher
  // with windows calls floor.
  for (int thick : {1, 2, 4, 6})
    for (const int grey : {20, 240})
      for (bool along : {true, false}) {
        Pair pair;
        const int x1 = along ? 260 : 160 + thick;
        const int y1 = along ? 60 + thick : 120;
        const int y0 = along ? 60 : 10;
        pair.paint(along ? 100 : 160, y0, x1, y1, kFloor_px + 12, static_cast<std::uint8_t>(grey));
        pair.look();
        const double kept = along ? pair.kept(114, 60, 246, y1) : pair.kept(160, 12, x1, 118);
        EXPECT_LT(kept, 0.03) << thick << " px, grey " << int(grey)
                              << (along ? " along" : " across");
      }
}

TEST(Evidence, AnEdgeAlongTheBaselineDoesNotKeepASurfaceFromBeingJoined) {
  // A wide level thing at its own disparity, with texture: nothing of it is taken back but its rim.
  Pair pair;
  Pair other(1.4);
  for (int y = 40; y < 90; ++y)
    for (int x = 100; x < 200; ++x) {
      const std::size_t at = std::size_t(y) * kWidth + std::size_t(x);
      const auto grey = static_cast<std::uint8_t>(other.left[at] / 2);
      pair.left[at] = grey;
      pair.right[at - kFloor_px] = grey;
    }
  pair.look();
  EXPECT_GT(pair.kept(108, 44, 192, 86), 0.93);
}

TEST(Evidence, AMatchThatIsHalfExplainedIsKeptAsLikelyOnly) {
  Pair pair;
  std::mt19937 random(3);
  for (int y = 30; y < 90; ++y)
    for (int x = 80; x < 240; ++x) {
      auto& p = pair.right[std::size_t(y) * kWidth + std::size_t(x)];
      p = static_cast<std::uint8_t>(std::clamp(int(p) + int(random() % 15) - 7, 0, 255));
    }
  const EvidenceReport report = pair.look();
  EXPECT_GT(report.weak, 500U);
  for (std::size_t i = 0; i < pair.disparity.size(); ++i) {
    EXPECT_LE(pair.disparity[i], kFloor_px * kDisparityScale);
    if (pair.disparity[i] != 0) EXPECT_EQ(std::abs(pair.disparity[i]), kFloor_px * kDisparityScale);
    EXPECT_EQ(pair.confidence[i] == 0, pair.disparity[i] == 0);
  }
}

/// Matches that are left of an image made by `brightness(x, y)` with a match at every pixel.
double left_by_repetition(const std::function<double(double x, double y)>& brightness) {
  std::vector<std::uint8_t> image;
  std::mt19937 random(9);
  std::normal_distribution<double> grain(0, 1.5);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      image.push_back(static_cast<std::uint8_t>(
          std::clamp(std::lround(brightness(x, y) + grain(random)), 0L, 255L)));
  std::vector<std::int16_t> disparity(image.size(), kFloor_px * kDisparityScale);
  std::vector<std::uint8_t> confidence(image.size(), 255);
  Repetition repetition(kWidth, kHeight, 64, 93);
  const std::uint32_t dropped =
      repetition.drop_ambiguous({image.data(), kWidth, kHeight, kWidth}, disparity, confidence);
  const auto kept =
      std::count_if(confidence.begin(), confidence.end(), [](auto c) { return c > 0; });
  EXPECT_EQ(std::size_t(kept) + dropped, image.size());
  for (std::size_t i = 0; i < image.size(); ++i)  // one that fits, for whoever can tell
    EXPECT_EQ(disparity[i], kFloor_px * kDisparityScale);
  return double(kept) / double(image.size());
}

TEST(Repetition, WhatRepeatsAlongTheRowsWithinTheSearchIsNoMatch) {
  const auto wave = [](double x, double period) { return std::fmod(x, period) < period / 2; };
  for (double period : {4.0, 7.3, 11.67, 20.0, 33.3, 55.0}) {
    EXPECT_LT(left_by_repetition([&](double x, double) { return wave(x, period) ? 60 : 160; }),
              0.05)
        << "stripes of " << period;
    EXPECT_LT(left_by_repetition(
                  [&](double x, double y) { return wave(x + y * 0.5, period) ? 60 : 160; }),
              0.05)
        << "slanting stripes of " << period;
    EXPECT_LT(left_by_repetition([&](double x, double y) {
                return wave(x, period) != wave(y, period) ? 60 : 160;
              }),
              0.05)
        << "checker of " << period;
  }
}

TEST(Repetition, WhatIsOnlyLikelyOrBeyondTheSearchIsNotEvenOneOfSeveral) {
  std::vector<std::uint8_t> image;
  for (int i = 0; i < kWidth * kHeight; ++i) image.push_back(i % kWidth % 20 < 10 ? 60 : 160);
  std::vector<std::int16_t> disparity(image.size(), -kFloor_px * kDisparityScale);
  std::fill_n(disparity.begin(), image.size() / 2, std::int16_t(94 * kDisparityScale));
  std::vector<std::uint8_t> confidence(image.size(), 255);
  Repetition repetition(kWidth, kHeight, 64, 93);
  repetition.drop_ambiguous({image.data(), kWidth, kHeight, kWidth}, disparity, confidence);
  for (std::size_t i = 0; i < image.size(); ++i)
    EXPECT_TRUE(confidence[i] == 255 || disparity[i] == 0);
  EXPECT_GT(std::count(disparity.begin(), disparity.end(), 0), kWidth * kHeight / 2);
}

TEST(Repetition, RandomTextureEdgesAndPlainAreasAreLeftAlone) {
  std::mt19937 random(2);
  std::vector<double> grey(std::size_t(kWidth / 4) * (kHeight / 4));
  for (double& g : grey) g = 60 + double(random() % 120);
  const auto blobs = [&](double x, double y) {
    return grey[std::size_t(int(y) / 4 * (kWidth / 4) + int(x) / 4)];
  };
  EXPECT_EQ(left_by_repetition(blobs), 1);
  EXPECT_EQ(left_by_repetition([](double, double) { return 120; }), 1);
  EXPECT_EQ(left_by_repetition([](double x, double) { return x / 2; }), 1);
  EXPECT_EQ(left_by_repetition([](double x, double) { return x < 150 ? 50 : 200; }), 1);
  EXPECT_EQ(left_by_repetition([](double, double y) { return int(y) % 8 < 4 ? 50 : 200; }), 1)
      << "rows that repeat downwards do not repeat along";
  EXPECT_GT(left_by_repetition(
                [&](double x, double y) { return blobs(x, y) * (int(x) % 40 < 20 ? 0.8 : 1.2); }),
            0.95)
      << "a pattern on a floor that has a texture of its own";
}

}  // namespace
}  // namespace crane
