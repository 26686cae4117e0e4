// SPDX-License-Identifier: Apache-2.0
// The mount from rendered images, with truth. One rendering serves all: what is told of camera and
// rangefinders is wrong, images are right. Then the drive is mapped by what was written.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>

#include "accuracy/trial.hpp"
#include "mount/mount_files.hpp"
#include "recording/calibration.hpp"
#include "sim/simulate.hpp"
#include "temp_folder.hpp"
#include "watch_trial.hpp"

namespace crane::accuracy {
namespace {

namespace fs = std::filesystem;

class MountRendered : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempFolder;
    auto scene = read_scene(CRANEMAP_WATCHDOG_SCENES "/drive.yaml");
    ASSERT_TRUE(scene) << scene.error().text();
    scene_ = new Scene(make_quick(*scene));
    SimulateOptions options;
    options.folder = *folder_ / "drive";
    const auto done = simulate(*scene_, options);
    ASSERT_TRUE(done) << done.error().text();
    recording_ = new Recording(*Recording::open(options.folder));
    auto drive = read_drive(*recording_, recording_->rig(), {});
    ASSERT_TRUE(drive) << drive.error().text();
    drive_ = new Drive(std::move(*drive));
  }
  static void TearDownTestSuite() {
    delete drive_;
    delete recording_;
    delete scene_;
    delete folder_;
  }
  static std::vector<Fault> faults(const std::vector<std::string>& texts) {
    std::vector<Fault> out;
    for (const std::string& f : texts) out.push_back(*parse_fault(f));
    return out;
  }
  /// As if it had been recorded with these faults.
  static Drive spoilt(const std::vector<std::string>& texts) {
    Drive d = *drive_;
    d.rig = told_rig(d.rig, faults(texts));
    d.told_height_m = d.rig.camera_height_m();
    spoil(d.cart, faults(texts), true, d.frames[d.frames.size() / 2].time);
    spoil(d.trolley, faults(texts), false, d.frames[d.frames.size() / 2].time);
    return d;
  }
  static MountCalibration of(const std::vector<std::string>& texts, MountOptions options = {}) {
    return calibrate_mount(spoilt(texts), options);
  }
  static void expect_true_mount(const MountCalibration& c) {
    const Eigen::Isometry3d& truth = scene_->camera.rig.T_map_camera_at_zero;
    ASSERT_NE(c.verdict, MountVerdict::kBad) << mount_text(c);
    const Eigen::Matrix3d off = c.rig.T_map_camera_at_zero.linear() * truth.linear().transpose();
    EXPECT_LT(Eigen::AngleAxisd(off).angle() * 180 / M_PI, 0.05) << mount_text(c);
    EXPECT_NEAR(c.rig.camera_height_m(), truth.translation().z(), 0.003) << mount_text(c);
    EXPECT_LT(std::abs(c.rig.camera_height_m() - truth.translation().z()),
              4 * c.of(MountItem::kHeight).sigma)
        << mount_text(c);
  }
  static test::TempFolder* folder_;
  static Scene* scene_;
  static Recording* recording_;
  static Drive* drive_;
};
test::TempFolder* MountRendered::folder_ = nullptr;
Scene* MountRendered::scene_ = nullptr;
Recording* MountRendered::recording_ = nullptr;
Drive* MountRendered::drive_ = nullptr;

TEST_F(MountRendered, FindsTiltHeightAndYaw) {
  for (const auto& told : {std::vector<std::string>{},
                           {"tilt=3"},
                           {"tilt=-3", "yaw=2"},
                           {"height=0.08"},
                           {"tilt=1", "height=-0.06", "yaw=-5"}})
    expect_true_mount(of(told));
}

TEST_F(MountRendered, FindsDelayAndScale) {
  const MountCalibration c =
      of({"delay=80", "scale=0.01", "trolley_delay=-30", "trolley_scale=-0.01", "tilt=3"});
  expect_true_mount(c);
  EXPECT_NEAR(c.of(MountItem::kCartLatency).value, 80, 5) << mount_text(c);
  EXPECT_NEAR(c.of(MountItem::kTrolleyLatency).value, -30, 5) << mount_text(c);
  EXPECT_NEAR(c.of(MountItem::kCartScale).value, 1 / 1.01, 0.001) << mount_text(c);
  EXPECT_NEAR(c.of(MountItem::kTrolleyScale).value, 1 / 0.99, 0.001) << mount_text(c);
}

TEST_F(MountRendered, FindsDirections) {
  MountCalibration c = of({"direction=6"});
  expect_true_mount(c);
  EXPECT_EQ(c.mapper.cart_direction, -1);
  EXPECT_EQ(c.mapper.trolley_direction, 1);
  c = of({"trolley_direction=6"});
  expect_true_mount(c);
  EXPECT_EQ(c.mapper.cart_direction, 1);
  EXPECT_EQ(c.mapper.trolley_direction, -1);
}

TEST_F(MountRendered, IsNotLedAstrayByLyingRangefinders) {
  const MountCalibration c = of({"outlier=2", "trolley_outlier=-0.5", "zero=3"});
  expect_true_mount(c);
  EXPECT_EQ(of({"jump=0.5"}).verdict, MountVerdict::kBad);
}

TEST_F(MountRendered, ChecksATargetThatIsNotUsed) {
  MountOptions options;
  options.start_m = Eigen::Vector2d(1.5, 1.5);
  options.targets = {parse_floor_target("2.3,1.45,0.45").value()};
  MountCalibration c = of({"tilt=2"}, options);
  ASSERT_EQ(c.targets.size(), 1U);
  EXPECT_TRUE(c.targets[0].seen) << mount_text(c);
  EXPECT_NEAR(c.targets[0].height_m, 0.45, 0.01);
  EXPECT_TRUE(c.targets[0].agrees);
  options.targets = {parse_floor_target("2.3,1.45,0.55").value()};
  c = of({"tilt=2"}, options);
  EXPECT_EQ(c.verdict, MountVerdict::kBad) << mount_text(c);
}

TEST_F(MountRendered, WhatIsWrittenMapsWithoutAnyComplaint) {
  const std::vector<std::string> wrong = {"tilt=3",    "height=0.07",      "yaw=-2",
                                          "delay=80",  "trolley_delay=80", "direction=6",
                                          "scale=0.01"};
  MountOptions options;
  options.start_m = Eigen::Vector2d(1.5, 1.5);
  const MountCalibration c = of(wrong, options);
  expect_true_mount(c);
  EXPECT_NEAR(c.mapper.cart_offset_m, 6, 0.03) << mount_text(c);
  // The recording as it would have been made, with what was written in place of what was told; the
  // scale as a live rangefinder takes it.
  const std::string folder = *folder_ / "written";
  fs::copy(recording_->folder(), folder, fs::copy_options::recursive);
  ASSERT_TRUE(write_rig(c.rig, folder, 5));
  const Drive d = spoilt(wrong);
  for (const bool cart : {true, false}) {
    std::ofstream csv(folder + (cart ? "/cart0/data.csv" : "/trolley0/data.csv"));
    csv << "#timestamp [ns],distance [m]\n";
    for (const RecordedDistance& r : cart ? d.cart : d.trolley)
      csv << r.time << "," << c.scale[cart ? 0 : 1] * r.distance_m << "\n";
  }
  const auto again = Recording::open(folder);
  ASSERT_TRUE(again) << again.error().text();
  Method method = cranemap_method(0.02);
  const double voxel_m = method.mapper.voxel_m;
  method.mapper = c.mapper;
  method.mapper.voxel_m = voxel_m;
  const auto outcome = run_trial(*again, *scene_, method);
  ASSERT_TRUE(outcome) << outcome.error().text();
  // As good as by the true mount: somebody walks there, whom no mount makes safe.
  const Method by_truth = cranemap_method(voxel_m);
  const auto best = run_trial(*recording_, *scene_, by_truth);
  ASSERT_TRUE(best) << best.error().text();
  EXPECT_LE(outcome->judgement.unsafe, best->judgement.unsafe + 0.005);
  EXPECT_GT(outcome->frames, 45U);
  const auto watched = watch(*again, {}, {}, true, c.mapper);
  ASSERT_TRUE(watched) << watched.error().text();
  EXPECT_EQ(watched->state, WatchState::kFine) << text_of(watched->misfit);
  EXPECT_EQ(watched->drifting_after, -1);
  EXPECT_EQ(watched->wrong_after, -1);
  // And with what was told before, it complains: this can fail.
  const auto unsafe = watch(*recording_, faults(wrong));
  ASSERT_TRUE(unsafe);
  EXPECT_EQ(unsafe->state, WatchState::kWrong);
}

}  // namespace
}  // namespace crane::accuracy
