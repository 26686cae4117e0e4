// SPDX-License-Identifier: Apache-2.0
#include "config/camera_config.hpp"

#include <gtest/gtest.h>

#include "config/site_config.hpp"

namespace crane {
namespace {

Result<SiteConfig> parse(const std::string& camera) {
  return parse_site_config("camera: " + camera + "\n", "test");
}

TEST(CameraConfig, TwoCamerasAndTheirRuleAreReadAndWritten) {
  const auto config = parse(
      "{source: genicam, path: 10.0.0.1, right: 10.0.0.2, pair_by: number, pair_within_ms: 40, "
      "rate_hz: 20, pixel_format: RGB8, trigger: Line1, stamps: chunk, ptp: true}");
  ASSERT_TRUE(config) << config.error().text();
  const auto again = parse_site_config(to_yaml(*config), "again");
  ASSERT_TRUE(again) << again.error().text();
  const CameraConfig& c = again->camera;
  EXPECT_EQ(to_yaml(*again), to_yaml(*config));
  EXPECT_EQ(c.source, CameraConfig::Source::kGenicam);
  EXPECT_EQ(c.right, "10.0.0.2");
  EXPECT_EQ(c.pair_by, CameraConfig::PairBy::kNumber);
  EXPECT_EQ(c.pair_within_ms, 40);
  EXPECT_EQ(c.pixel_format, "RGB8");
  EXPECT_EQ(c.trigger, "Line1");
  EXPECT_EQ(c.stamps, CameraConfig::Stamps::kChunk);
  EXPECT_TRUE(c.ptp);
}

TEST(CameraConfig, APipelineIsReadAndWritten) {
  const auto config = parse(
      "{source: gstreamer, pipeline: \"videotestsrc is-live=true ! appsink\", for_viewing: true}");
  ASSERT_TRUE(config) << config.error().text();
  const auto again = parse_site_config(to_yaml(*config), "again");
  ASSERT_TRUE(again);
  EXPECT_EQ(again->camera.pipeline, "videotestsrc is-live=true ! appsink");
  EXPECT_TRUE(again->camera.for_viewing);
}

TEST(CameraConfig, WhatDoesNotFitTogetherIsRefused) {
  for (const char* wrong : {
           "{source: genicam}",
           "{source: gstreamer}",
           "{source: gstreamer, path: /dev/video0, pipeline: x ! appsink}",
           "{source: v4l2, path: /x, pipeline: x ! appsink}",
           "{source: v4l2, path: /x, for_viewing: true}",
           "{source: v4l2, path: /x, trigger: software}",
           "{source: v4l2, path: /x, ptp: true}",
           "{source: v4l2, path: /x, right: /x}",
           "{source: v4l2, path: /x, right: /y, layout: y8i}",
           "{source: v4l2, path: /x, right: /y, swap: true}",
           "{source: v4l2, path: /x, right: /y, exposure_100us: 40, brightness: 100}",
           "{source: folder, path: /x, right: /y}",
           "{source: v4l2, path: /x, pair_by: number}",
           "{source: v4l2, path: /x, pair_within_ms: 4}",
           "{source: v4l2, path: /x, right: /y, rate_hz: 10, pair_within_ms: 50}",
           "{source: v4l2, path: /x, right: /y, rate_hz: 10, pair_by: number, pair_within_ms: 100}",
           "{source: genicam, path: x, brightness: 100, exposure_100us: 40}",
       })
    EXPECT_FALSE(parse(wrong)) << wrong;
}

}  // namespace
}  // namespace crane
