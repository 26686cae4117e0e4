#include "dds/validate.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "bounds.h"

namespace crane::dds {
namespace {

TEST(Validate, StereoFrameNeedsKnownEncodingAndAFittingSize) {
  auto frame = std::make_unique<v1::StereoFrame>();
  frame->encoding(v1::ENCODING_MONO8);
  frame->width(1280);
  frame->height(720);
  frame->exposure_time_ns(1);
  EXPECT_EQ(flaw(*frame), nullptr);
  frame->height(721);
  EXPECT_NE(flaw(*frame), nullptr);
  frame->width(0xFFFFFFFF);
  frame->height(0xFFFFFFFF);  // their product overflows 64 bits less than it seems
  EXPECT_NE(flaw(*frame), nullptr);
  frame->width(1280);
  frame->height(720);
  frame->encoding(3);
  EXPECT_NE(flaw(*frame), nullptr);
}

TEST(Validate, PartialCloudNeedsAFiniteCameraModel) {
  auto cloud = std::make_unique<v1::PartialCloud>();
  cloud->width(4);
  cloud->height(4);
  cloud->exposure_time_ns(1);
  cloud->f_px(700);
  cloud->baseline_m(0.12);
  cloud->sigma_disparity_px(0.2);
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

}  // namespace
}  // namespace crane::dds
