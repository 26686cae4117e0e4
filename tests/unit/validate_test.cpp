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

}  // namespace
}  // namespace crane::dds
