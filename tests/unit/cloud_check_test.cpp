// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/cloud_check.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "geometry/calibration_digest.hpp"

namespace crane {
namespace {

CloudSample good() {
  CloudSample c;
  c.calibration = 7;
  c.frame.width = 8;
  c.frame.height = 4;
  c.frame.f_px = 10;
  c.frame.cx_px = 3.5;
  c.frame.cy_px = 1.5;
  c.frame.baseline_m = 0.1;
  c.frame.sigma_disparity_px = 0.05;
  c.depth_m.assign(32, 2);
  c.confidence.assign(32, 255);
  return c;
}

TEST(CloudCheck, RefusesEachThingThatCannotBe) {
  CloudSample c = good();
  EXPECT_FALSE(check_cloud(c, 7));
  const std::function<void(CloudSample&)> flaws[] = {
      [](CloudSample& x) { x.frame.width = 9; },
      [](CloudSample& x) { x.frame.height = 0; },
      [](CloudSample& x) { x.depth_m.pop_back(); },
      [](CloudSample& x) { x.confidence.clear(); },
      [](CloudSample& x) { x.colour.resize(95); },
      [](CloudSample& x) { x.frame.f_px = std::numeric_limits<double>::quiet_NaN(); },
      [](CloudSample& x) { x.frame.f_px = -10; },
      [](CloudSample& x) { x.frame.cx_px = 1e4; },
      [](CloudSample& x) { x.frame.baseline_m = 0; },
      [](CloudSample& x) { x.frame.sigma_disparity_px = 0; },
      [](CloudSample& x) { x.R_camera_rectified *= 2; },
      [](CloudSample& x) { x.R_camera_rectified(0, 0) = -1; },
  };
  for (const auto& flaw : flaws) {
    c = good();
    flaw(c);
    EXPECT_EQ(check_cloud(c, 7), Cause::kCloudMisfit) << &flaw - flaws;
  }
}

TEST(CloudCheck, ADepthWithoutConfidenceIsOneOfSeveralAndNoMatch) {
  CloudSample c = good();
  EXPECT_FALSE(check_cloud(c, 7));
  EXPECT_TRUE(c.ambiguous_m.empty());
  c.confidence[5] = c.confidence[6] = 0;
  c.depth_m[6] = -2;
  EXPECT_FALSE(check_cloud(c, 7));
  ASSERT_EQ(c.ambiguous_m.size(), c.depth_m.size());
  for (std::size_t i = 0; i < c.depth_m.size(); ++i) {
    EXPECT_EQ(c.depth_m[i], i == 5 || i == 6 ? 0 : 2);
    EXPECT_EQ(c.ambiguous_m[i], i == 5 ? 2 : 0);
  }
}

TEST(CloudCheck, DepthsThatCannotBeMeasuredAreNoMatch) {
  CloudSample c = good();
  c.depth_m[0] = std::numeric_limits<float>::infinity();
  c.depth_m[1] = std::numeric_limits<float>::quiet_NaN();
  c.depth_m[2] = -1e9F;
  c.depth_m[3] = 1e9F;
  EXPECT_FALSE(check_cloud(c, 7));
  for (std::size_t i = 0; i < c.depth_m.size(); ++i) EXPECT_EQ(c.depth_m[i], i < 4 ? 0 : 2);
}

TEST(CloudCheck, ACloudOfAnotherCalibrationOrOfNoneIsRefused) {
  CloudSample c = good();
  EXPECT_EQ(check_cloud(c, 8), Cause::kCloudOtherCalibration);
  c.calibration = 0;
  EXPECT_EQ(check_cloud(c, 7), Cause::kCloudOtherCalibration);
}

TEST(CalibrationDigest, ChangesWithEveryNumberAndNotWithARounding) {
  StereoRig rig;
  rig.left = rig.right = {1280, 720, 700, 700, 640, 360, 0.1, 0.01, 0, 0};
  const std::uint64_t digest = calibration_digest(rig);
  EXPECT_NE(digest, 0U);
  const std::function<void(StereoRig&)> changes[] = {
      [](StereoRig& r) { r.left.fx_px += 1e-3; },
      [](StereoRig& r) { r.right.cy_px += 1e-3; },
      [](StereoRig& r) { r.left.k2 += 1e-6; },
      [](StereoRig& r) { r.right.width = 640; },
      [](StereoRig& r) { r.T_map_camera_at_zero.translation().z() += 1e-3; },
      [](StereoRig& r) { std::swap(r.left.k1, r.left.k2); },
  };
  for (const auto& change : changes) {
    StereoRig other = rig;
    change(other);
    EXPECT_NE(calibration_digest(other), digest) << &change - changes;
  }
  StereoRig same = rig;
  same.left.fx_px += 1e-12;
  EXPECT_EQ(calibration_digest(same), digest);
}

}  // namespace
}  // namespace crane
