// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/brightness_control.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace crane {
namespace {

constexpr double kTarget = 110;

/// A camera in some light: grey = light x exposure x (1 + gain / 16), cut at 255; settings take two
/// frames to show.
struct Hall {
  double light = 1;
  std::vector<BrightnessControl::Setting> settings = {{100, 0}, {100, 0}};
  [[nodiscard]] Brightness seen() const {
    const auto& s = settings[settings.size() - 2];
    const double grey = light * s.exposure * (1 + s.gain / 16.0);
    return {std::min(grey, 255.0), grey > 240 ? 1.0 : 0.0};
  }
  /// Frames until nothing is set for 40 of them; -1: it swings for ever.
  int settle(BrightnessControl& control) {
    int quiet = 0;
    for (int n = 0; n < 1000; ++n) {
      const auto next = control.after(seen());
      settings.push_back(next.value_or(settings.back()));
      quiet = next ? 0 : quiet + 1;
      if (quiet == 40) return n - 39;
    }
    return -1;
  }
};

BrightnessControl control_from(BrightnessControl::Setting now) {
  return {kTarget, {1, 200}, {0, 64}, now};
}

TEST(BrightnessControl, FindsTheTargetFromTooDarkAndTooBrightAndThenLeavesItAlone) {
  for (const double light : {0.2, 0.4, 1.0, 1.1, 3.0, 20.0}) {
    Hall hall;
    hall.light = light;
    auto control = control_from({100, 0});
    const int frames = hall.settle(control);
    ASSERT_GE(frames, 0) << light;
    EXPECT_LE(frames, 200) << light;
    EXPECT_NEAR(hall.seen().mean, kTarget, 0.25 * kTarget) << light;
    EXPECT_FALSE(control.at_limit());
  }
}

TEST(BrightnessControl, GainComesAfterExposureAndGoesBeforeIt) {
  Hall hall;
  hall.light = 0.3;
  auto control = control_from({100, 0});
  ASSERT_GE(hall.settle(control), 0);
  EXPECT_EQ(hall.settings.back().exposure, 200) << "what motion allows";
  EXPECT_GT(hall.settings.back().gain, 0);
  hall.light = 1.5;
  ASSERT_GE(hall.settle(control), 0);
  EXPECT_EQ(hall.settings.back().gain, 0);
  EXPECT_LT(hall.settings.back().exposure, 200);
}

TEST(BrightnessControl, SaysWhenItsLimitsForbidMore) {
  for (const double light : {0.01, 300.0}) {
    Hall hall;
    hall.light = light;
    auto control = control_from({100, 0});
    ASSERT_GE(hall.settle(control), 0);
    EXPECT_TRUE(control.at_limit()) << light;
    EXPECT_EQ(hall.settings.back().exposure, light < 1 ? 200 : 1);
  }
}

TEST(BrightnessControl, LampsThatSaturateAreMadeDarkerWhateverTheMean) {
  auto control = control_from({100, 0});
  std::optional<BrightnessControl::Setting> set;
  for (int n = 0; n < BrightnessControl::kSettle; ++n) set = control.after({kTarget, 0.05});
  ASSERT_TRUE(set);
  EXPECT_EQ(set->exposure, 75);
}

TEST(BrightnessControl, JudgesBothImagesTogether) {
  std::vector<std::uint8_t> left(64 * 32 * 3, 100), right(64 * 32 * 3, 255);
  FrameFacts facts;
  facts.width = 64;
  facts.height = 32;
  facts.format = PixelFormat::kBgr8;
  const Brightness seen = brightness_of({left.data(), right.data(), left.size(), 64 * 32}, facts);
  EXPECT_NEAR(seen.mean, 177.5, 1e-9);
  EXPECT_NEAR(seen.saturated, 0.5, 1e-9);
}

}  // namespace
}  // namespace crane
