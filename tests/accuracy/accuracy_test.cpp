// SPDX-License-Identifier: Apache-2.0
// The quick part of the accuracy report: scenes that nothing was tuned on must do as well.

#include <gtest/gtest.h>

#include <cmath>

#include "mapping/heights.hpp"
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
  scene.camera.rig.T_left_right.rotate(Eigen::AngleAxisd(0.02, Eigen::Vector3d(0.6, 0.64, 0.48)));
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

/// Share of the columns well inside a box whose map says what `is` asks.
template <class Is>
double share_of(const OccupancyMap& map, const TrueObstacle& box, Is is) {
  const double c = std::cos(box.yaw_rad), s = std::sin(box.yaw_rad);
  std::size_t all = 0, right = 0;
  for (int y = map.index(box.y_m - 0.5); y <= map.index(box.y_m + 0.5); ++y)
    for (int x = map.index(box.x_m - 0.5); x <= map.index(box.x_m + 0.5); ++x) {
      const double dx = map.centre(x) - box.x_m, dy = map.centre(y) - box.y_m;
      if (std::abs(c * dx + s * dy) > 0.4 * box.size_x_m ||
          std::abs(c * dy - s * dx) > 0.4 * box.size_y_m)
        continue;
      ++all;
      const Tile* tile = map.find({tile_of(x), tile_of(y)});
      if (tile == nullptr) continue;
      const auto heights = tile_heights(map, *tile, floor_tolerance_m(map.voxel_m()));
      right += is(heights[std::size_t(in_tile(y) * kTileEdge + in_tile(x))]) ? 1 : 0;
    }
  return double(right) / double(all);
}

TEST(Change, WhatLeftIsClearedAndWhatCameIsThereAfterThreeObservations) {
  auto scene = shipped_scene("moved");
  ASSERT_TRUE(scene) << scene.error().text();
  const test::TempFolder folder;
  auto recording = render(*scene, folder / "recording");
  ASSERT_TRUE(recording) << recording.error().text();
  const TrueObstacle before = scene->obstacles[1].shape, after = scene->obstacles[2].shape;
  constexpr std::size_t kMoved = 200;  // 20 s at 10 Hz: from this frame on
  const auto stands = [](const TrueObstacle& box) {
    return [height = box.height_m](const ColumnHeight& c) {
      return c.state == ColumnState::kObstacle && std::abs(c.height_m - height) < 0.02;
    };
  };
  const auto is_floor = [](const ColumnHeight& c) { return c.state == ColumnState::kFloor; };
  std::vector<double> cleared, appeared;
  Method method = cranemap_method(0.03);
  method.watch = [&](std::size_t frame, const OccupancyMap& map) {
    if (frame == kMoved - 1) {
      EXPECT_GE(share_of(map, before, stands(before)), 0.99) << "there before it moved";
      EXPECT_GE(share_of(map, after, is_floor), 0.99);
    }
    if (frame < kMoved || frame >= kMoved + 4) return;
    cleared.push_back(share_of(map, before, is_floor));
    appeared.push_back(share_of(map, after, stands(after)));
  };
  auto outcome = run_trial(*recording, *scene, method);
  ASSERT_TRUE(outcome) << outcome.error().text();
  ASSERT_EQ(cleared.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i)
    std::printf(
        "observation %zu: %.3f of the place left is floor, %.3f of the place taken is crate\n",
        i + 1, cleared[i], appeared[i]);
  EXPECT_LE(cleared[0], 0.02) << "one frame clears nothing";
  EXPECT_LE(appeared[0], 0.02) << "one frame is no obstacle";
  EXPECT_GE(cleared[2], 0.98);
  EXPECT_GE(appeared[2], 0.98);
}

TEST(Hoist, ACarriedLoadIsNoObstacleAndOneSetDownIs) {
  auto scene = shipped_scene("carry");
  ASSERT_TRUE(scene) << scene.error().text();
  const test::TempFolder folder;
  auto recording = render(*scene, folder / "recording");
  ASSERT_TRUE(recording) << recording.error().text();
  auto site = read_site_config(recording->folder() + "/site.yaml");
  ASSERT_TRUE(site) << site.error().text();
  // Everything higher than a hand between where the load was picked up and where it was set down.
  const auto trail = [](const client::HeightGrid& grid) {
    std::size_t high = 0;
    for (std::size_t i = 0; i < grid.cells.size(); ++i) {
      const double x = grid.x_m(i);
      const double y = grid.y_m(i);
      if (x > 0.3 && x < 1.9 && y > 0.35 && y < 1.1)
        high += client::is_known(grid.cells[i].surface) && grid.cells[i].height_m > 0.1;
    }
    return high;
  };
  Method method = cranemap_method(0.03);
  method.hoist = site->hoist;
  // Where the load passed at 0.65 m, while it has not been set down yet.
  TrueObstacle passed = scene->obstacles[1].shape;
  passed.x_m = 1.4;
  double proven = 0;
  method.watch = [&](std::size_t frame, const OccupancyMap& map) {
    if (frame == 105)
      proven = share_of(map, passed, [](const ColumnHeight& c) {
        return std::isfinite(c.proven_m) && std::abs(c.proven_m - 0.66) < 0.05;
      });
  };
  auto with = run_trial(*recording, *scene, method);
  ASSERT_TRUE(with) << with.error().text();
  EXPECT_EQ(with->frames, 200U);
  EXPECT_EQ(trail(with->grid), 0U);
  EXPECT_GE(proven, 0.98) << "the volume that the load swept is proven free";
  for (const ObstacleHeight& h : with->heights)
    if (h.name != "crate_before") EXPECT_LE(h.error_percent(), 2) << h.name;
  EXPECT_EQ(with->judgement.unsafe, 0);
  EXPECT_EQ(with->judgement.missed, 0);
  auto without = run_trial(*recording, *scene, cranemap_method(0.03));
  ASSERT_TRUE(without) << without.error().text();
  EXPECT_GT(trail(without->grid), 20U) << "the scene shows what is being guarded against";
}

}  // namespace
}  // namespace crane::accuracy
