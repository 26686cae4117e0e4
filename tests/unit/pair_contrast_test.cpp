// SPDX-License-Identifier: Apache-2.0
#include "stereo/pair_contrast.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace crane {
namespace {

constexpr int kWidth = 480, kHeight = 320, kShift = 20;
using Pixels = std::vector<std::uint8_t>;

GreyView view(const Pixels& pixels) {
  return {pixels.data(), kWidth, kHeight, kWidth};
}

/// What a camera makes of a scene: brightness by gain and offset, noise, whole grey levels.
struct Exposure {
  double gain = 1, offset = 0, noise = 0;
};

/// Two pictures of the same textured plane, `kShift` px apart; standard deviation of its texture
/// at gain 1: about 10 grey levels, as on the floors of the sample recordings.
struct Pair {
  Pixels left, right;

  Pair(const Exposure& l, const Exposure& r, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const int wide = kWidth + kShift;
    std::vector<double> raw(std::size_t(wide) * kHeight), scene(raw.size());
    for (double& p : raw) p = normal(random);
    for (int y = 1; y + 1 < kHeight; ++y)
      for (int x = 1; x + 1 < wide; ++x) {
        double sum = 0;
        for (int v = -1; v <= 1; ++v)
          for (int u = -1; u <= 1; ++u) sum += raw[std::size_t((y + v) * wide + x + u)];
        scene[std::size_t(y * wide + x)] = 120 + 10 * sum / 3;
      }
    for (const bool is_left : {true, false}) {
      const Exposure& e = is_left ? l : r;
      Pixels& out = is_left ? left : right;
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const double light = scene[std::size_t(y * wide + x + (is_left ? 0 : kShift))];
          const double grey = e.gain * light + e.offset + e.noise * normal(random);
          out.push_back(static_cast<std::uint8_t>(std::clamp(std::round(grey), 0.0, 255.0)));
        }
    }
  }
};

std::vector<std::int16_t> all_at(int px) {
  return std::vector<std::int16_t>(std::size_t{kWidth} * kHeight,
                                   static_cast<std::int16_t>(px * kDisparityScale));
}

std::optional<PairFlaw> flaw(const Exposure& l, const Exposure& r, int disparity_px = kShift) {
  const Pair pair(l, r);
  return flaw_of(look_at_contrast(view(pair.left), view(pair.right), all_at(disparity_px), 1));
}

TEST(PairContrast, TakesWhatIsDarkButSeen) {
  for (const double gain : {1.0, 0.5, 0.25, 0.18}) {
    const Exposure e{gain, 0, 2 * gain};
    EXPECT_EQ(flaw(e, e), std::nullopt) << gain;
  }
  EXPECT_EQ(flaw({0.25, 200, 0.3}, {0.25, 200, 0.3}), std::nullopt) << "bright and pale";
}

/// Two cameras never have quite the same exposure.
TEST(PairContrast, DoesNotMindThatOneCameraIsBrighter) {
  EXPECT_EQ(flaw({1, 0, 2}, {0.4, 0, 1}), std::nullopt);
  EXPECT_EQ(flaw({0.4, 60, 1}, {1, 0, 2}), std::nullopt);
}

TEST(PairContrast, RefusesWhatIsTooDarkInEitherImage) {
  const Exposure dark{0.0625, 0, 0}, noisy{0.125, 0, 2}, good{1, 0, 1};
  EXPECT_EQ(flaw(dark, dark), PairFlaw::kTooDark);
  EXPECT_EQ(flaw(noisy, noisy), PairFlaw::kTooDark);
  EXPECT_EQ(flaw(dark, good), PairFlaw::kTooDark);
  EXPECT_EQ(flaw(good, dark), PairFlaw::kTooDark);
}

TEST(PairContrast, RefusesWhatIsWhiteWhereAnythingIsToBeSeen) {
  const Exposure white{2, 60, 0}, good{1, 0, 1};
  EXPECT_EQ(flaw(white, white), PairFlaw::kLeftSaturated);
  EXPECT_EQ(flaw({1.6, 0, 1}, {1.6, 0, 1}), std::nullopt) << "bright, but all is to be seen";
  EXPECT_NE(flaw(white, good), std::nullopt);
}

TEST(PairContrast, RefusesFogAndOneGreyLevelAllOver) {
  const Exposure fog{0.0625, 140, 1}, plain{0, 140, 0}, almost{0, 140, 0.4};
  for (const Exposure& e : {fog, plain, almost}) {
    EXPECT_EQ(flaw(e, e), PairFlaw::kNoContrast);
    EXPECT_EQ(flaw(e, {1, 0, 1}), PairFlaw::kNoContrast);
  }
  // Nothing matched: said as well, rather than taken for swapped cameras.
  const Pair none(plain, plain);
  EXPECT_EQ(flaw_of(look_at_contrast(view(none.left), view(none.right), all_at(0), 1)),
            PairFlaw::kNoContrast);
}

TEST(PairContrast, RefusesNoiseThatIsMatched) {
  const Exposure only{0, 120, 10}, mostly{0.5, 60, 8};
  EXPECT_EQ(flaw(only, only), PairFlaw::kTooNoisy);
  EXPECT_EQ(flaw(mostly, mostly), PairFlaw::kTooNoisy);
}

TEST(PairContrast, RefusesDisparitiesThatTheImagesDoNotShow) {
  const Exposure good{1, 0, 1};
  EXPECT_NE(flaw(good, good, kShift + 9), std::nullopt);
  EXPECT_NE(flaw(good, good, kShift - 7), std::nullopt);
}

/// Few pixels of a floor without marks match; those that do are seen.
TEST(PairContrast, AsksOnlyOfWhatMatched) {
  const Exposure good{1, 0, 1};
  Pair pair(good, good);
  std::vector<std::int16_t> disparity = all_at(kShift);
  for (int y = 0; y < kHeight; ++y)
    for (int x = kWidth / 3; x < kWidth; ++x) {
      const auto i = std::size_t(y * kWidth + x);
      pair.left[i] = 128;
      if (x >= kWidth / 3 + kShift) pair.right[i - kShift] = 128;
      disparity[i] = 0;
    }
  const auto contrast = look_at_contrast(view(pair.left), view(pair.right), disparity, 1);
  EXPECT_LT(contrast.matched, contrast.patches / 3);
  EXPECT_EQ(flaw_of(contrast), std::nullopt);
}

TEST(PairContrast, InvalidDisparitiesOfOtherMatchersAreNoMatch) {
  const Exposure good{1, 0, 1};
  const Pair pair(good, good);
  const auto contrast = look_at_contrast(view(pair.left), view(pair.right), all_at(kShift),
                                         (kShift + 1) * kDisparityScale);
  EXPECT_EQ(contrast.matched, 0);
}

}  // namespace
}  // namespace crane
