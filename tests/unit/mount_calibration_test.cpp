// SPDX-License-Identifier: Apache-2.0
// The mount from sightings and readings with exact truth: right drives, and those that would be
// wrong in silence.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mount/commissioning.hpp"
#include "mount/mount_files.hpp"
#include "unit/mount_drives.hpp"

namespace crane::test {
namespace {

using ::testing::HasSubstr;

MountCalibration of(const DriveRecipe& recipe, const MountOptions& options = {}) {
  return calibrate_mount(make_drive(recipe), options);
}

std::string said(const MountCalibration& c) {
  return mount_text(c);
}

/// Within `tolerance`, and no farther off than its sigma lets expect.
void expect_value(const MountCalibration& c, MountItem item, double truth, double tolerance) {
  const MountValue& v = c.of(item);
  ASSERT_TRUE(v.determined) << name_of(item).key << ": " << v.why_not << "\n" << said(c);
  EXPECT_NEAR(v.value, truth, tolerance) << name_of(item).key << "\n" << said(c);
  EXPECT_LT(std::abs(v.value - truth), 4 * v.sigma + 1e-9) << name_of(item).key << "\n" << said(c);
  EXPECT_LT(v.sigma, tolerance) << name_of(item).key;
}

TEST(MountCalibration, RecoversTiltHeightYawScaleAndDelayWithHonestSigmas) {
  DriveRecipe r;
  r.tilt_x_deg = 3, r.tilt_y_deg = -1, r.yaw_deg = 2, r.height_m = 2.03;
  r.scale = {1.01, 0.992}, r.delay_s = {0.08, 0.03};
  for (r.seed = 1; r.seed <= 3; ++r.seed) {
    const MountCalibration c = of(r);
    ASSERT_NE(c.verdict, MountVerdict::kBad) << said(c);
    expect_value(c, MountItem::kTiltX, 3, 0.05);
    expect_value(c, MountItem::kTiltY, -1, 0.05);
    expect_value(c, MountItem::kYaw, 2, 0.05);
    expect_value(c, MountItem::kHeight, 2.03, 0.003);
    expect_value(c, MountItem::kCartScale, 1 / 1.01, 0.001);
    expect_value(c, MountItem::kTrolleyScale, 1 / 0.992, 0.001);
    expect_value(c, MountItem::kCartLatency, 80, 5);
    expect_value(c, MountItem::kTrolleyLatency, 30, 5);
  }
}

TEST(MountCalibration, FindsEachWayTheCameraMayHangAndEachDirection) {
  for (const double yaw : {0., 90., 180., -90.})
    for (const int bridge : {1, -1})
      for (const int trolley : {1, -1}) {
        DriveRecipe r;
        r.yaw_deg = yaw, r.told_yaw_deg = yaw, r.direction = {bridge, trolley};
        const MountCalibration c = of(r);
        ASSERT_NE(c.verdict, MountVerdict::kBad) << said(c);
        EXPECT_EQ(c.mapper.cart_direction, bridge);
        EXPECT_EQ(c.mapper.trolley_direction, trolley);
        const double off = std::remainder(c.of(MountItem::kYaw).value - yaw, 360);
        EXPECT_NEAR(off, 0, 0.05);
      }
}

TEST(MountCalibration, SaysAQuarterTurnThatNobodyToldAndWhatElseItMayBe) {
  DriveRecipe r;
  r.yaw_deg = 90;
  const MountCalibration c = of(r);
  EXPECT_EQ(c.verdict, MountVerdict::kUsable);
  EXPECT_THAT(said(c), HasSubstr("rangefinders of bridge and trolley are swapped"));
  EXPECT_NEAR(std::abs(c.of(MountItem::kYaw).value), 90, 0.05);
}

TEST(MountCalibration, GivesNoValueForWhatOneAxisAloneDoesNotTell) {
  DriveRecipe r;
  r.drive_trolley = false;
  const MountCalibration c = of(r);
  EXPECT_EQ(c.verdict, MountVerdict::kBad);
  for (const MountItem item : {MountItem::kTiltX, MountItem::kTiltY, MountItem::kTrolleyDirection,
                               MountItem::kTrolleyScale, MountItem::kTrolleyLatency,
                               MountItem::kHeight, MountItem::kSkew, MountItem::kFloorSlopeX})
    EXPECT_FALSE(c.of(item).determined) << name_of(item).key;
  EXPECT_THAT(said(c), HasSubstr("the trolley was not driven: drive it at least"));
  EXPECT_TRUE(c.of(MountItem::kCartScale).determined) << said(c);
}

TEST(MountCalibration, SaysThatTheCraneStands) {
  DriveRecipe r;
  r.drive_bridge = r.drive_trolley = false;
  const MountCalibration c = of(r);
  EXPECT_EQ(c.verdict, MountVerdict::kBad);
  EXPECT_THAT(said(c), HasSubstr("the crane stands"));
}

TEST(MountCalibration, SaysThatTheDriveIsTooShort) {
  DriveRecipe r;
  r.seconds = 1.9;
  EXPECT_EQ(of(r).verdict, MountVerdict::kBad);
  r.seconds = 6;
  EXPECT_EQ(of(r).verdict, MountVerdict::kBad) << said(of(r));
}

TEST(MountCalibration, SaysThatThereIsNoTexture) {
  DriveRecipe r;
  r.points_seen = 8;
  const MountCalibration c = of(r);
  EXPECT_EQ(c.verdict, MountVerdict::kBad);
  EXPECT_THAT(said(c), HasSubstr("no texture"));
}

TEST(MountCalibration, LeavesTheDelayOpenWhereTheSpeedNeverChanges) {
  DriveRecipe r;
  r.constant_speed = true;
  r.drive_trolley = false;
  const MountCalibration c = of(r);
  EXPECT_FALSE(c.of(MountItem::kCartLatency).determined) << said(c);
  EXPECT_TRUE(c.of(MountItem::kCartScale).determined) << said(c);
  EXPECT_THAT(said(c), HasSubstr("the speed did not change enough"));
  EXPECT_EQ(c.mapper.cart_latency_ms, 0);
}

TEST(MountCalibration, SaysThatBothAxesAlwaysMovedTogether) {
  DriveRecipe r;
  r.constant_speed = true;
  const MountCalibration c = of(r);
  EXPECT_EQ(c.verdict, MountVerdict::kBad);
  EXPECT_THAT(said(c), HasSubstr("one after the other"));
}

// ------------------------------------------------------------------ Wrong in silence.

TEST(MountCalibration, TellsASlopedFloorFromATiltedCamera) {
  DriveRecipe r;
  r.tilt_x_deg = 1;
  r.floor_slope = {0.01, -0.005};
  const MountCalibration c = of(r);
  expect_value(c, MountItem::kTiltX, 1, 0.05);
  expect_value(c, MountItem::kFloorSlopeX, 0.573, 0.05);
  expect_value(c, MountItem::kFloorSlopeY, -0.286, 0.05);
  EXPECT_THAT(said(c), HasSubstr("the floor is not parallel to the rails"));
}

TEST(MountCalibration, TakesTheFloorBelowObjectsThatCoverHalfOfIt) {
  DriveRecipe r;
  r.objects = 0.5;
  const MountCalibration c = of(r);
  expect_value(c, MountItem::kHeight, 2, 0.003);
  EXPECT_THAT(said(c), HasSubstr("several levels are seen"));
}

TEST(MountCalibration, DoubtsAFloorThatIsFarFromWhatWasTold) {
  DriveRecipe r;
  r.objects = 1;  // a platform everywhere: nothing else could tell
  const MountCalibration c = of(r);
  EXPECT_EQ(c.verdict, MountVerdict::kUsable);
  EXPECT_THAT(said(c), HasSubstr("is what the camera saw the floor"));
}

TEST(MountCalibration, LeavesOutALoadThatComesAlong) {
  DriveRecipe r;
  r.load = 0.6, r.points_seen = 200;
  const MountCalibration c = of(r);
  ASSERT_NE(c.verdict, MountVerdict::kBad) << said(c);
  expect_value(c, MountItem::kHeight, 2, 0.004);
  expect_value(c, MountItem::kCartScale, 1, 0.002);
  EXPECT_GT(c.drive.moving_with_camera, 50U);
}

TEST(MountCalibration, SaysThatALoadFillsTheView) {
  DriveRecipe r;
  r.load = 1;
  const MountCalibration c = of(r);
  EXPECT_EQ(c.verdict, MountVerdict::kBad) << said(c);
}

TEST(MountCalibration, IsNotLedAstrayByWalkers) {
  DriveRecipe r;
  r.walkers = 0.2;
  const MountCalibration c = of(r);
  expect_value(c, MountItem::kHeight, 2, 0.004);
  expect_value(c, MountItem::kCartScale, 1, 0.002);
}

TEST(MountCalibration, LeavesOutReadingsFarOff) {
  DriveRecipe r;
  r.spoil_cart = [](std::vector<RecordedDistance>& cart) {
    for (std::size_t i = 20; i < cart.size(); i += 25) cart[i].distance_m += i % 2 ? 0.4 : -0.3;
    cart[31].distance_m = 0;
  };
  const MountCalibration c = of(r);
  expect_value(c, MountItem::kCartScale, 1, 0.001);
  expect_value(c, MountItem::kCartLatency, 0, 5);
  EXPECT_GT(c.drive.dropped_readings[0], 15U);
}

TEST(MountCalibration, RepeatedReadingsAreNoDelay) {
  DriveRecipe r;
  r.readings_hz = 40;
  r.spoil_cart = [](std::vector<RecordedDistance>& cart) {
    for (std::size_t i = 0; i < cart.size(); ++i) cart[i].distance_m = cart[i - i % 4].distance_m;
  };
  const MountCalibration c = of(r);
  expect_value(c, MountItem::kCartLatency, 0, 6);
  EXPECT_THAT(said(c), HasSubstr("says each measurement"));
}

TEST(MountCalibration, NamesARangefinderThatJumpsOrSticks) {
  DriveRecipe r;
  r.spoil_cart = [](std::vector<RecordedDistance>& cart) {
    for (std::size_t i = cart.size() / 2; i < cart.size(); ++i) cart[i].distance_m += 0.5;
  };
  MountCalibration c = of(r);
  EXPECT_EQ(c.verdict, MountVerdict::kBad);
  EXPECT_THAT(said(c), HasSubstr("the bridge's rangefinder jumps by"));
  r.spoil_cart = [](std::vector<RecordedDistance>& cart) {
    for (std::size_t i = cart.size() / 2; i < cart.size(); ++i)
      cart[i].distance_m = cart[cart.size() / 2].distance_m;
  };
  c = of(r);
  EXPECT_EQ(c.verdict, MountVerdict::kBad) << said(c);
}

TEST(MountCalibration, NamesTwoRangefindersOfOneAxis) {
  DriveRecipe r;
  Drive d = make_drive(r);
  d.trolley = d.cart;
  const MountCalibration c = calibrate_mount(d, {});
  EXPECT_EQ(c.verdict, MountVerdict::kBad) << said(c);
}

// ------------------------------------------------------------------ What is told.

TEST(MountCalibration, GivesOffsetsFromWhereTheCraneStood) {
  DriveRecipe r;
  r.direction = {-1, 1};
  MountOptions options;
  EXPECT_FALSE(of(r).of(MountItem::kCartOffset).determined);
  options.start_m = Eigen::Vector2d(1, 1);
  const MountCalibration c = of(r, options);
  EXPECT_NEAR(c.mapper.cart_offset_m, 12, 0.01);
  EXPECT_NEAR(c.mapper.trolley_offset_m, 0, 0.01);
}

TEST(MountCalibration, FindsTheBridgesSkew) {
  DriveRecipe r;
  r.skew = std::tan(0.5 * std::numbers::pi / 180);
  const MountCalibration c = of(r);
  expect_value(c, MountItem::kSkew, -0.5, 0.05);
  EXPECT_THAT(said(c), HasSubstr("skew by -0."));
}

// ------------------------------------------------------------------ The day of commissioning.

TEST(Commissioning, IsReadBackAsItWasWritten) {
  const MountCalibration c = of({});
  const Commissioning kept = commissioning_of(c, "2026-11-30");
  const auto read = parse_commissioning(to_yaml(kept), "commissioning.yaml");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read.value().date, "2026-11-30");
  ASSERT_EQ(read.value().values.size(), kept.values.size());
  for (std::size_t i = 0; i < kept.values.size(); ++i) {
    EXPECT_EQ(read.value().values[i].value, kept.values[i].value);
    EXPECT_EQ(read.value().values[i].sigma, kept.values[i].sigma);
  }
}

TEST(Commissioning, NamesWhatIsWrongInTheFile) {
  const auto read = parse_commissioning(
      "date: '2026-11-30'\nmount:\n  height_m: [2, -1]\n  hight_m: [2, 1]\n", "c.yaml");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().text(), HasSubstr("hight_m"));
  EXPECT_THAT(read.error().text(), HasSubstr("below 0"));
  EXPECT_FALSE(parse_commissioning("", "empty.yaml"));
}

TEST(Commissioning, TellsWhatHasChangedFromWhatHasNot) {
  DriveRecipe r;
  const Commissioning then = commissioning_of(of(r), "2026-11-30");
  r.seed = 7;
  for (const CheckedItem& item : compare(then, of(r)))
    EXPECT_NE(item.state, CheckState::kChanged) << item.text;
  r.tilt_x_deg = 0.4;
  r.delay_s = {0.06, 0};
  std::vector<MountItem> changed;
  for (const CheckedItem& item : compare(then, of(r)))
    if (item.state == CheckState::kChanged) changed.push_back(item.item);
  EXPECT_EQ(changed, (std::vector<MountItem>{MountItem::kTiltX, MountItem::kCartLatency}));
  r.drive_trolley = false;
  for (const CheckedItem& item : compare(then, of(r)))
    if (item.item == MountItem::kTiltX) {
      EXPECT_EQ(item.state, CheckState::kNotMeasured);
    }
}

}  // namespace
}  // namespace crane::test
