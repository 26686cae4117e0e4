// SPDX-License-Identifier: Apache-2.0
// What hangs below the trolley and what a second rail says, from drives with exact truth.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mapping_pipeline/gantry.hpp"
#include "mount/mount_files.hpp"
#include "unit/mount_drives.hpp"

namespace crane::test {
namespace {

using ::testing::HasSubstr;

DriveRecipe with_hook() {
  DriveRecipe r;
  r.tilt_x_deg = 3, r.tilt_y_deg = -1, r.eye_m = {0.2, -0.1};
  r.hook_height_m = 0.9, r.hook_m = {0.35, 0.05};
  return r;
}

TEST(MountHook, HangsWhereItHangsSeenByATiltedCameraBesideIt) {
  MountOptions options;
  options.hook_height_m = 0.9;
  const MountCalibration c = calibrate_mount(make_drive(with_hook()), options);
  ASSERT_TRUE(c.of(MountItem::kHookX).determined) << mount_text(c);
  EXPECT_NEAR(c.of(MountItem::kHookX).value, 0.35, 0.01) << mount_text(c);
  EXPECT_NEAR(c.of(MountItem::kHookY).value, 0.05, 0.01) << mount_text(c);
  EXPECT_LT(c.of(MountItem::kHookX).sigma, 0.06);
  SiteConfig site;
  apply(c, site);
  EXPECT_NEAR(site.hoist.offset_x_m, 0.35, 0.01);
  EXPECT_NEAR(site.hoist.offset_y_m, 0.05, 0.01);
}

TEST(MountHook, IsNotDeterminedWhereNothingHangsAtTheToldHeight) {
  MountOptions options;
  EXPECT_THAT(calibrate_mount(make_drive(with_hook()), options).of(MountItem::kHookX).why_not,
              HasSubstr("--hook-height"));
  options.hook_height_m = 0.2;
  const MountCalibration c = calibrate_mount(make_drive(with_hook()), options);
  EXPECT_FALSE(c.of(MountItem::kHookX).determined) << mount_text(c);
  EXPECT_THAT(c.of(MountItem::kHookX).why_not, HasSubstr("hang the hook where the camera sees it"));
}

/// A bridge that swings about a mean skew, with a rangefinder at each rail.
DriveRecipe with_rails(int direction, int second_direction) {
  DriveRecipe r;
  r.tilt_x_deg = 2, r.yaw_deg = 1, r.eye_m = {0.2, -0.1};
  r.rail_y_m = -2, r.rail_span_m = 8, r.skew = 0.004, r.skew_swing = 0.003;
  r.direction = {direction, 1}, r.second_direction = second_direction;
  r.second_offset_m = second_direction > 0 ? -0.6 : 12.7;
  return r;
}

/// The camera as the mapper places it, by what was written, against where it was.
void expect_true_places(const DriveRecipe& r, const Drive& drive, const MountCalibration& c) {
  Gantry gantry(c.mapper);
  std::vector<std::tuple<TimeNs, Axis, double>> readings;
  for (const auto& d : drive.cart) readings.emplace_back(d.time, Axis::kCart, d.distance_m);
  for (const auto& d : drive.trolley) readings.emplace_back(d.time, Axis::kTrolley, d.distance_m);
  for (const auto& d : drive.cart_second)
    readings.emplace_back(d.time, Axis::kCartSecond, d.distance_m);
  std::sort(readings.begin(), readings.end());
  std::size_t at = 0, judged = 0;
  for (const DriveFrame& frame : drive.frames) {
    for (; at < readings.size() && std::get<0>(readings[at]) < frame.time + 200'000'000; ++at)
      (void)gantry.add(std::get<1>(readings[at]), 1, std::get<0>(readings[at]),
                       std::get<2>(readings[at]));
    const Gantry::Place place = gantry.at(frame.time);
    if (place.known != PositionTrack::Lookup::kFound) continue;
    ++judged;
    const double t = double(frame.time - drive.frames.front().time) * 1e-9;
    const double per_m = skew_at(r, t);
    const Eigen::Vector2d g = drive_at(r, t);
    EXPECT_NEAR(place.map_m.x(), g.x() + per_m * (g.y() - r.rail_y_m), 0.01) << t;
    EXPECT_NEAR(place.map_m.y(), g.y(), 0.01) << t;
    EXPECT_NEAR(place.skew_rad, -std::atan(per_m), 0.001) << t;
    const Eigen::Matrix3d seen =
        Eigen::AngleAxisd(place.skew_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
        c.rig.T_map_camera_at_zero.linear();
    const Eigen::Matrix3d truth =
        Eigen::AngleAxisd(-std::atan(per_m), Eigen::Vector3d::UnitZ()).toRotationMatrix() *
        camera_rotation(r.tilt_x_deg, r.tilt_y_deg, r.yaw_deg);
    EXPECT_LT(Eigen::AngleAxisd(seen * truth.transpose()).angle(), 0.0015) << t;
  }
  EXPECT_GT(judged, drive.frames.size() / 2);
}

TEST(MountRails, ThePlacesOfASkewBridgeComeOutAsTheyWereWhicheverWayTheLasersLook) {
  for (const int direction : {1, -1})
    for (const int second : {1, -1}) {
      SCOPED_TRACE(std::to_string(direction) + " " + std::to_string(second));
      const DriveRecipe r = with_rails(direction, second);
      const Drive drive = make_drive(r);
      MountOptions options;
      options.told.rail_y_m = r.rail_y_m;
      options.told.rail_span_m = r.rail_span_m;
      options.told.trolley_offset_m = 1.7;  // nobody knew it, hence --start
      // The trolley stood there: off the first rail's coordinate by the skew over what lies
      // between.
      options.start_m = Eigen::Vector2d(1 + 0.004 * (1 - r.rail_y_m), 1);
      const MountCalibration c = calibrate_mount(drive, options);
      ASSERT_NE(c.verdict, MountVerdict::kBad) << mount_text(c);
      ASSERT_TRUE(c.of(MountItem::kCartSecondOffset).determined) << mount_text(c);
      EXPECT_EQ(c.mapper.cart_second_direction, second);
      EXPECT_NEAR(c.mapper.cart_second_offset_m, r.second_offset_m, 0.02) << mount_text(c);
      expect_true_places(r, drive, c);
    }
}

}  // namespace
}  // namespace crane::test
