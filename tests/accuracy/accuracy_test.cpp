// The quick part of the accuracy report: scenes that nothing was tuned on must do as well.

#include <gtest/gtest.h>

#include "temp_folder.hpp"
#include "trial.hpp"

namespace crane::accuracy {
namespace {

constexpr double kVoxel = 0.02;

/// The rig with few rays, so that the tests stay quick.
Scene rig_scene(std::uint64_t seed) {
  auto scene = shipped_scene("rig");
  EXPECT_TRUE(scene) << scene.error().text();
  scene->camera.samples = 1;
  scene->seed = seed;
  return *scene;
}

Outcome trial(const Scene& scene, const Method& method) {
  const test::TempFolder folder;
  auto recording = render(scene, folder / "recording");
  EXPECT_TRUE(recording) << recording.error().text();
  auto outcome = run_trial(*recording, scene, method);
  EXPECT_TRUE(outcome) << outcome.error().text();
  return *outcome;
}

void expect_exact_and_safe(const Outcome& o) {
  EXPECT_EQ(o.frames, 6U);
  for (const ObstacleHeight& h : o.heights) EXPECT_LE(h.error_percent(), 2) << h.name;
  EXPECT_LE(o.mean_percent(), 1);
  EXPECT_EQ(o.judgement.unsafe, 0);
  EXPECT_EQ(o.judgement.missed, 0);
  EXPECT_LE(o.judgement.phantom, 0.001);
  EXPECT_GE(o.judgement.coverage, 0.95);
  EXPECT_GT(o.free_voxels, 500'000U);
  EXPECT_GE(o.free_precision, 0.999);
}

TEST(Accuracy, IsTenTimesThePapersOnTheSameImages) {
  const Scene scene = rig_scene(7);
  const test::TempFolder folder;
  auto recording = render(scene, folder / "recording");
  ASSERT_TRUE(recording) << recording.error().text();
  auto ours = run_trial(*recording, scene, cranemap_method(0.1));
  auto paper = run_trial(*recording, scene, paper_method(0.1));
  ASSERT_TRUE(ours) << ours.error().text();
  ASSERT_TRUE(paper) << paper.error().text();
  EXPECT_LT(10 * ours->mean_percent(), paper->mean_percent());
  EXPECT_LE(ours->worst_percent(), 2);
}

TEST(Accuracy, HoldsForLensDistortionAndARotatedRightCamera) {
  Scene scene = rig_scene(3);
  for (CameraModel* c : {&scene.camera.rig.left, &scene.camera.rig.right}) {
    c->k1 = -0.12;
    c->k2 = 0.03;
    c->p1 = 0.0008;
    c->p2 = -0.0005;
  }
  scene.camera.rig.T_body_right.rotate(Eigen::AngleAxisd(0.02, Eigen::Vector3d(0.6, 0.64, 0.48)));
  expect_exact_and_safe(trial(scene, cranemap_method(kVoxel)));
}

TEST(Accuracy, HoldsForATiltedMount) {
  Scene scene = rig_scene(4);
  scene.camera.rig.T_map_camera_at_zero.rotate(
      Eigen::AngleAxisd(0.05, Eigen::Vector3d(0.8, 0.6, 0)));
  expect_exact_and_safe(trial(scene, cranemap_method(kVoxel)));
}

TEST(Accuracy, DoesNotMapThingsLowerThatStandNearerThanTheSearch) {
  Scene scene = rig_scene(6);
  scene.camera.rig.T_map_camera_at_zero.translation().z() = 1.4;  // the chair fills 0.63 of it
  const Outcome o = trial(scene, cranemap_method(kVoxel));
  EXPECT_LE(o.judgement.unsafe, 0.002);  // a column or two on the edge of the chair's back
  EXPECT_EQ(o.judgement.missed, 0);
  EXPECT_LE(o.judgement.phantom, 0.001);
  EXPECT_LE(o.worst_percent(), 2);
}

TEST(Accuracy, HoldsForOtherObstaclesFromThreeMetres) {
  Scene scene = rig_scene(5);
  scene.camera.rig.T_map_camera_at_zero.translation().z() = 3;
  for (Lamp& lamp : scene.lamps) lamp.centre.z() = 4.5, lamp.power *= 2;
  const auto put = [&](std::size_t i, double x, double y, double height, double yaw) {
    TrueObstacle& s = scene.obstacles[i].shape;
    s.x_m = x, s.y_m = y, s.height_m = height, s.yaw_rad = yaw;
  };
  put(0, 2.4, 1.5, 1.10, 0);
  put(1, 0.4, 0.4, 0.30, 0);
  put(2, 1.4, 0.9, 0.75, 0.7);
  put(4, 0.9, 1.7, 0.50, 1.2);
  put(3, 2.3, 0.3, 0.88, 2.4);
  expect_exact_and_safe(trial(scene, cranemap_method(0.03)));  // 1 % of the height
}

}  // namespace
}  // namespace crane::accuracy
