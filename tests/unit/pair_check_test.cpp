// SPDX-License-Identifier: Apache-2.0
#include "stereo/pair_check.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace crane {
namespace {

constexpr int kWidth = 320, kHeight = 200;
using Pixels = std::vector<std::uint8_t>;

GreyView view(const Pixels& pixels) {
  return {pixels.data(), kWidth, kHeight, kWidth};
}

/// Random brightness, smoothed over 3 x 3 pixels.
Pixels texture(unsigned seed) {
  std::mt19937 random(seed);
  Pixels raw(std::size_t{kWidth} * kHeight);
  for (std::uint8_t& p : raw) p = static_cast<std::uint8_t>(random() % 256);
  Pixels out = raw;
  for (int y = 1; y + 1 < kHeight; ++y)
    for (int x = 1; x + 1 < kWidth; ++x) {
      int sum = 0;
      for (int v = -1; v <= 1; ++v)
        for (int u = -1; u <= 1; ++u) sum += raw[std::size_t((y + v) * kWidth + x + u)];
      out[std::size_t(y * kWidth + x)] = static_cast<std::uint8_t>(sum / 9);
    }
  return out;
}

TEST(PairCheck, NamesTheCameraThatIsBlackOrSaturated) {
  const Pixels good = texture(1), black(good.size(), 3), white(good.size(), 254);
  PairCheck check;
  EXPECT_EQ(check.look(view(good), view(good), 0), std::nullopt);
  EXPECT_EQ(check.look(view(black), view(texture(2)), 1), PairFlaw::kLeftBlack);
  EXPECT_EQ(check.look(view(texture(3)), view(black), 2), PairFlaw::kRightBlack);
  EXPECT_EQ(check.look(view(white), view(texture(4)), 3), PairFlaw::kLeftSaturated);
  EXPECT_EQ(check.look(view(texture(5)), view(white), 4), PairFlaw::kRightSaturated);
}

TEST(PairCheck, AnImageRepeatedInAnotherFrameIsFrozenAndAFrameSentAgainIsNot) {
  const Pixels a = texture(1), b = texture(2), c = texture(3);
  PairCheck check;
  EXPECT_EQ(check.look(view(a), view(b), 7), std::nullopt);
  EXPECT_EQ(check.look(view(a), view(b), 7), std::nullopt);
  EXPECT_EQ(check.look(view(a), view(c), 8), PairFlaw::kLeftFrozen);
  EXPECT_EQ(check.look(view(b), view(c), 9), PairFlaw::kRightFrozen);
  EXPECT_EQ(check.look(view(c), view(a), 10), std::nullopt);
}

TEST(RowError, IsTheVerticalDistanceOfTheImages) {
  const Pixels left = texture(1);
  const std::vector<std::int16_t> disparity(left.size(), 20 * kDisparityScale);
  for (int lower : {-2, -1, 0, 1, 2}) {
    Pixels right(left.size(), 128);
    for (int y = 4; y + 4 < kHeight; ++y)
      for (int x = 0; x + 20 < kWidth; ++x)
        right[std::size_t((y + lower) * kWidth + x)] = left[std::size_t(y * kWidth + x + 20)];
    const RowError error = row_error(view(left), view(right), disparity);
    ASSERT_GT(error.patches, 20U);
    EXPECT_NEAR(error.offset_px, lower, 0.1);
    EXPECT_NEAR(error.roll_rad * kWidth / 2, 0, 0.1);
    EXPECT_NEAR(error.slope * kHeight / 2, 0, 0.1);
    EXPECT_NEAR(*largest_px(error, kWidth, kHeight), lower, 0.2);
  }
}

TEST(RowError, IsNotMeasuredWithoutTextureOrMatches) {
  const Pixels flat(std::size_t{kWidth} * kHeight, 90), left = texture(1);
  EXPECT_EQ(
      row_error(view(flat), view(flat), std::vector<std::int16_t>(flat.size(), 640)).patches, 0U);
  EXPECT_EQ(row_error(view(left), view(left), std::vector<std::int16_t>(left.size(), 0)).patches,
            0U);
}

}  // namespace
}  // namespace crane
