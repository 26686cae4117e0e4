// SPDX-License-Identifier: Apache-2.0
#include "stereo/semi_global.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "stereo/subpixel.hpp"

namespace crane {
namespace {

/// A pair whose right image is the left one moved by a known disparity: a smooth random texture,
/// sampled exactly, with noise.
struct Scene {
  int width = 320, height = 96;
  std::vector<std::uint8_t> left, right;
  std::vector<float> truth;

  template <class DisparityOf, class Contrast>
  Scene(DisparityOf disparity_of, Contrast contrast, double noise = 1) {
    std::mt19937 random(11);
    std::normal_distribution<double> grain(0, noise);
    std::vector<double> phase(40 * 4);
    std::uniform_real_distribution<double> any(0, 6.28);
    for (double& p : phase) p = any(random);
    const auto texture = [&](double x, double y) {
      double sum = 0;
      for (std::size_t k = 0; k < 40; ++k)
        sum += std::sin(x * (0.15 + 0.03 * double(k % 20)) * std::cos(phase[4 * k]) +
                        y * 0.7 * std::sin(phase[4 * k + 1]) + phase[4 * k + 2]);
      return sum / 6;
    };
    left.resize(std::size_t(width) * height);
    right.resize(left.size());
    truth.resize(left.size());
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x)
        left[std::size_t(y) * width + x] =
            pixel(128 + contrast(x, y) * texture(x, y) + grain(random));
      // The right image sees the left's surface that is nearest: the largest disparity.
      for (int x = 0; x < width; ++x) {
        double at = -1;
        for (int l = width + 80; l >= x; --l)
          if (std::abs(l - disparity_of(l, y) - x) < 0.75) {
            at = x + disparity_of(l, y);
            break;
          }
        const double l = at >= 0 ? at : x + 500;
        right[std::size_t(y) * width + x] =
            pixel(128 + contrast(l, y) * texture(l, y) + grain(random));
      }
      for (int x = 0; x < width; ++x) truth[std::size_t(y) * width + x] = float(disparity_of(x, y));
    }
  }
  static std::uint8_t pixel(double v) {
    return static_cast<std::uint8_t>(std::lround(std::min(255.0, std::max(0.0, v))));
  }

  std::vector<std::int16_t> disparity;
  std::vector<std::uint8_t> confidence;
  SemiGlobalReport match(const SemiGlobalSettings& settings) {
    disparity.assign(left.size(), -7);
    confidence.assign(left.size(), 77);
    SemiGlobalMatcher matcher(width, height, settings);
    return matcher.match({left.data(), width, height, width}, {right.data(), width, height, width},
                         disparity, confidence);
  }
};

SemiGlobalSettings search(int first, int count, int row_step = 2) {
  SemiGlobalSettings s;
  s.first_px = first;
  s.count_px = count;
  s.row_step = row_step;
  return s;
}

double full(double, double) {
  return 40;
}

TEST(SemiGlobalMatcher, FindsALevelSurfaceToAFewHundredthsOfAPixelAtAnyFraction) {
  for (double d : {40.0, 40.25, 40.5, 40.75, 47.1}) {
    Scene scene([d](double, double) { return d; }, full);
    scene.match(search(30, 32));
    double sum = 0;
    std::size_t n = 0, wrong = 0;
    for (int y = 4; y < scene.height - 4; ++y)
      for (int x = 90; x < scene.width - 10; ++x) {
        const std::int16_t found = scene.disparity[std::size_t(y) * scene.width + x];
        if (found <= 0) continue;
        ++n;
        sum += double(found) / kDisparityScale - d;
        wrong += std::abs(double(found) / kDisparityScale - d) > 1 ? 1 : 0;
      }
    EXPECT_GT(n, 0.95 * 88 * 220) << d;
    EXPECT_EQ(wrong, 0U) << d;
    EXPECT_NEAR(sum / double(n), 0, 0.04) << d;
  }
}

TEST(SemiGlobalMatcher, KeepsAStepInDepthWhereItIs) {
  const auto box = [](double x, double y) {
    return x > 150 && x < 230 && y > 30 && y < 70 ? 55 : 42;
  };
  Scene scene(box, full);
  scene.match(search(32, 64, 1));
  std::size_t wrong = 0, matched = 0;
  for (int y = 4; y < scene.height - 4; ++y)
    for (int x = 100; x < scene.width - 10; ++x) {
      const std::size_t i = std::size_t(y) * scene.width + x;
      if (scene.disparity[i] <= 0) continue;
      ++matched;
      wrong += std::abs(double(scene.disparity[i]) / kDisparityScale - scene.truth[i]) > 1 ? 1 : 0;
    }
  EXPECT_GT(matched, 15'000U);
  EXPECT_LT(double(wrong) / double(matched), 0.03);  // the foreground's edge, a few pixels wide
}

TEST(SemiGlobalMatcher, AnswersTheSameEveryTime) {
  Scene scene([](double x, double) { return 38 + x / 40; }, full);
  scene.match(search(32, 32));
  const auto disparity = scene.disparity;
  const auto confidence = scene.confidence;
  for (int i = 0; i < 5; ++i) {
    scene.match(search(32, 32));
    ASSERT_EQ(scene.disparity, disparity);
    ASSERT_EQ(scene.confidence, confidence);
  }
}

TEST(SemiGlobalMatcher, EveryNumberOfDisparitiesFindsTheSameSurface) {
  Scene scene([](double, double) { return 20.5; }, full);
  for (int count : {32, 64, 96, 128, 192, 256}) {
    EXPECT_EQ(SemiGlobalMatcher::disparities(count), count);
    if (count + 8 >= scene.width) continue;
    const SemiGlobalReport report = scene.match(search(0, count));
    EXPECT_GT(report.matched, 0.7 * scene.width * scene.height) << count;
    EXPECT_NEAR(double(scene.disparity[std::size_t(48) * scene.width + 300]) / kDisparityScale,
                20.5, 0.15)
        << count;
  }
}

TEST(SemiGlobalMatcher, WhatIsNearerThanTheSearchIsNotMatchedButCounted) {
  Scene scene([](double, double) { return 63.0; }, full);
  const SemiGlobalReport at_end = scene.match(search(32, 32));
  EXPECT_LT(at_end.matched, 0.02 * scene.width * scene.height);
  EXPECT_GT(at_end.at_near_end, 0.3 * scene.width * scene.height);
}

TEST(SemiGlobalMatcher, BlackImagesAreNoMatch) {
  Scene scene([](double, double) { return 40.0; }, [](double, double) { return 0.0; }, 0);
  const SemiGlobalReport report = scene.match(search(32, 32));
  EXPECT_EQ(report.matched, 0U);
  for (std::uint8_t c : scene.confidence) ASSERT_EQ(c, 0);
}

TEST(SemiGlobalMatcher, APatchWithoutTextureIsUnmatchedOrItsSurroundingsAndSaysSo) {
  const auto patch = [](double x, double y) {
    return x > 160 && x < 220 && y > 30 && y < 66 ? 0.0 : 40.0;
  };
  Scene scene([](double, double) { return 44.0; }, patch);
  scene.match(search(32, 32));
  double inside = 0, outside = 0;
  std::size_t n_inside = 0, n_outside = 0;
  for (int y = 8; y < scene.height - 8; ++y)
    for (int x = 100; x < scene.width - 20; ++x) {
      const std::size_t i = std::size_t(y) * scene.width + x;
      if (scene.disparity[i] <= 0) continue;
      const bool in = x > 170 && x < 210 && y > 38 && y < 58;
      if (in) EXPECT_NEAR(double(scene.disparity[i]) / kDisparityScale, 44, 1) << x << ' ' << y;
      (in ? inside : outside) += scene.confidence[i];
      ++(in ? n_inside : n_outside);
    }
  ASSERT_GT(n_outside, 0U);
  if (n_inside > 0) EXPECT_LT(inside / double(n_inside), 0.6 * outside / double(n_outside));
}

TEST(SemiGlobalMatcher, NoiseIsNotASurface) {
  Scene scene([](double, double) { return 40.0; }, full);
  std::mt19937 random(5);
  for (std::uint8_t& p : scene.right) p = static_cast<std::uint8_t>(random());
  const SemiGlobalReport report = scene.match(search(32, 64));
  EXPECT_LT(report.matched, 0.02 * scene.width * scene.height);
}

}  // namespace
}  // namespace crane
