// SPDX-License-Identifier: Apache-2.0
#include "dds/validate.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "bounds.h"

namespace crane::dds {
namespace {

std::unique_ptr<StereoFrame> frame(std::uint32_t encoding, std::uint32_t width,
                                   std::uint32_t height, std::size_t bytes) {
  auto out = std::make_unique<StereoFrame>();
  out->encoding(encoding);
  out->width(width);
  out->height(height);
  out->exposure_time_ns(1);
  out->left().resize(bytes);
  out->right().resize(bytes);
  return out;
}

TEST(Validate, StereoFrameNeedsKnownEncodingAndAFittingSize) {
  EXPECT_EQ(flaw(*frame(v1::ENCODING_MONO8, 1280, 720, 1280 * 720)), nullptr);
  EXPECT_EQ(flaw(*frame(v1::ENCODING_MONO8, 1280, 720, 1280 * 720 + 1)), nullptr);
  EXPECT_NE(flaw(*frame(v1::ENCODING_MONO8, 1280, 720, 1280 * 720 - 1)), nullptr);
  EXPECT_EQ(flaw(*frame(v1::ENCODING_BAYER_BGGR8, 2448, 2048, 2448 * 2048)), nullptr);
  EXPECT_EQ(flaw(*frame(v1::ENCODING_MONO8, 2048, 2448, 2448 * 2048)), nullptr);
  EXPECT_NE(flaw(*frame(v1::ENCODING_MONO8, 2448, 2049, 2448 * 2049)), nullptr);
  // Their product overflows 64 bits less than it seems.
  EXPECT_NE(flaw(*frame(v1::ENCODING_MONO8, 0xFFFFFFFF, 0xFFFFFFFF, 100)), nullptr);
  EXPECT_NE(flaw(*frame(v1::ENCODING_JPEG, 0, 48, 100)), nullptr);
  EXPECT_NE(flaw(*frame(0, 64, 48, 64 * 48 * 3)), nullptr);
  EXPECT_NE(flaw(*frame(v1::ENCODING_JPEG + 1, 64, 48, 64 * 48 * 3)), nullptr);
  EXPECT_NE(flaw(*frame(0x40000001, 64, 48, 64 * 48 * 3)), nullptr);
}

TEST(Validate, EachEncodingHasItsBytesAndWidths) {
  for (const std::uint32_t encoding : {v1::ENCODING_BGR8, v1::ENCODING_RGB8}) {
    EXPECT_EQ(flaw(*frame(encoding, 63, 48, 63 * 48 * 3)), nullptr);
    EXPECT_NE(flaw(*frame(encoding, 63, 48, 63 * 48 * 3 - 1)), nullptr);
  }
  EXPECT_EQ(flaw(*frame(v1::ENCODING_YUYV, 64, 48, 64 * 48 * 2)), nullptr);
  EXPECT_NE(flaw(*frame(v1::ENCODING_YUYV, 64, 48, 64 * 48 * 2 - 1)), nullptr);
  EXPECT_NE(flaw(*frame(v1::ENCODING_YUYV, 63, 48, 64 * 48 * 2)), nullptr);
  for (std::uint32_t e = v1::ENCODING_MONO10P; e <= v1::ENCODING_BAYER_BGGR12P; ++e) {
    const bool ten = e == v1::ENCODING_MONO10P ||
                     (e >= v1::ENCODING_BAYER_RGGB10P && e <= v1::ENCODING_BAYER_BGGR10P);
    const std::size_t bytes = 64 * 48 * (ten ? 10 : 12) / 8;
    EXPECT_EQ(flaw(*frame(e, 64, 48, bytes)), nullptr) << e;
    EXPECT_NE(flaw(*frame(e, 64, 48, bytes - 1)), nullptr) << e;
    EXPECT_NE(flaw(*frame(e, 63, 48, bytes)), nullptr) << e;
    EXPECT_EQ(flaw(*frame(e, 62, 48, bytes)) == nullptr, !ten) << e;
  }
  EXPECT_EQ(flaw(*frame(v1::ENCODING_JPEG, 63, 48, 1)), nullptr);
  EXPECT_NE(flaw(*frame(v1::ENCODING_JPEG, 63, 48, 0)), nullptr);
}

TEST(Validate, PartialCloudNeedsAFiniteCameraModel) {
  auto cloud = std::make_unique<PartialCloud>();
  cloud->width(4);
  cloud->height(4);
  cloud->exposure_time_ns(1);
  cloud->f_px(700);
  cloud->baseline_m(0.12);
  cloud->sigma_disparity_px(0.2);
  EXPECT_NE(flaw(*cloud), nullptr) << "no depth";
  cloud->depth().resize(16);
  cloud->confidence().resize(16);
  EXPECT_EQ(flaw(*cloud), nullptr);
  cloud->has_colour(1);
  EXPECT_NE(flaw(*cloud), nullptr) << "no colour";
  cloud->colour().resize(48);
  EXPECT_EQ(flaw(*cloud), nullptr);
  cloud->rotation()[4] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(flaw(*cloud), nullptr);
  cloud->rotation()[4] = 1;
  cloud->f_px(0);
  EXPECT_NE(flaw(*cloud), nullptr);
}

TEST(Validate, RangefinderPositionNeedsAKnownAxisAndAFiniteDistance) {
  v1::RangefinderPosition p;
  p.axis(v1::AXIS_CART);
  p.time_ns(1);
  EXPECT_EQ(flaw(p), nullptr);
  p.distance_m(std::numeric_limits<double>::infinity());
  EXPECT_NE(flaw(p), nullptr);
  p.distance_m(1);
  p.axis(9);
  EXPECT_NE(flaw(p), nullptr);
}

TEST(Validate, HoistStateMustBeOfThisWorld) {
  v1::HoistState h;
  h.time_ns(1);
  h.hook_height_m(4);
  h.load_size_x_m(2);
  EXPECT_EQ(flaw(h), nullptr);
  for (const double bad : {1e300, -1e300, std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    for (auto set : {+[](v1::HoistState&s, double v) { s.hook_height_m(v); },
                     +[](v1::HoistState&s, double v) { s.sling_m(v); },
                     +[](v1::HoistState&s, double v) { s.load_size_y_m(v); },
                     +[](v1::HoistState&s, double v) { s.load_yaw_rad(v); },
                     +[](v1::HoistState&s, double v) { s.sway_x_m(v); }}) {
      v1::HoistState spoilt = h;
      set(spoilt, bad);
      EXPECT_NE(flaw(spoilt), nullptr) << bad;
    }
  }
}

TEST(Validate, AZonesCornersMustGoAroundOneArea) {
  const auto zone = [](std::initializer_list<std::pair<double, double>> corners) {
    v1::Zone z;
    z.id(2);
    z.kind(v1::ZONE_NO_GO);
    z.active(1);
    z.z_max_m(3);
    for (const auto& [x, y] : corners) {
      v1::ZoneCorner c;
      c.x_m(x);
      c.y_m(y);
      z.corners().push_back(c);
    }
    return z;
  };
  const auto good = zone({{1.6, 0.8}, {2.0, 0.8}, {2.0, 1.2}, {1.6, 1.2}});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  v1::ZoneCommand command;
  command.action(v1::ZONE_SET);
  command.zone(good);
  EXPECT_EQ(flaw(command), nullptr);
  v1::ZoneSet set;
  set.zones().push_back(good);
  EXPECT_EQ(flaw(set), nullptr);
  for (const auto& bad :
       {zone({{1.6, 0.8}, {2.0, 1.2}, {2.0, 0.8}, {1.6, 1.2}}), zone({}), zone({{0, 0}, {1, 0}}),
        zone({{0, 0}, {1, 0}, {2, 0}}), zone({{0, 0}, {1, 0}, {1, nan}}),
        zone({{0, 0}, {1, 0}, {1, 1}, {0, 0}})}) {
    command.zone(bad);
    EXPECT_NE(flaw(command), nullptr);
    set.zones()[0] = bad;
    EXPECT_NE(flaw(set), nullptr);
  }
  set.zones()[0] = good;
  set.zones().push_back(good);
  EXPECT_STREQ(flaw(set), "two zones have the same id");
}

}  // namespace
}  // namespace crane::dds
