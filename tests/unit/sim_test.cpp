// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "recording/recording.hpp"
#include "sim/renderer.hpp"
#include "sim/simulate.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

Scene small_scene(const std::string& name) {
  auto scene = read_scene(std::string(CRANEMAP_SOURCE_DIR "/shared/sim/scenes/") + name + ".yaml");
  EXPECT_TRUE(scene) << scene.error().text();
  for (CameraModel* c : {&scene->camera.rig.left, &scene->camera.rig.right}) {
    c->width = 160;
    c->height = 90;
    c->fx_px = c->fy_px = scene->camera.rig.left.fx_px / (c == &scene->camera.rig.left ? 8 : 1);
    c->cx_px = 79.5;
    c->cy_px = 44.5;
  }
  scene->camera.rig.right.fx_px = scene->camera.rig.right.fy_px = scene->camera.rig.left.fx_px;
  return *scene;
}

TEST(Scenes, AllShippedOnesAreRead) {
  for (const char* name : {"rig", "lap", "hall", "carry", "moved", "demo_round"}) small_scene(name);
}

TEST(Scenes, WhatRepeatsBeginsAnewWithAllThatHasItsTimes) {
  Scene scene = small_scene("demo_round");
  ASSERT_EQ(scene.motion.repeat_s, 90);
  for (const double t : {0.0, 7.5, 30.0, 89.0}) {
    EXPECT_EQ(gantry_at(scene.motion, t), gantry_at(scene.motion, t + 180));
    const auto first = obstacles_at(scene, t), third = obstacles_at(scene, t + 180);
    ASSERT_EQ(first.size(), third.size());
    for (std::size_t i = 0; i < first.size(); ++i)
      EXPECT_EQ(first[i].has_value(), third[i].has_value()) << t << " " << i;
    EXPECT_EQ(hoist_reading_at(scene, t).hook_height_m,
              hoist_reading_at(scene, t + 180).hook_height_m);
  }
  EXPECT_EQ(gantry_at(scene.motion, 90), scene.motion.points.front()) << "no jump";
  EXPECT_GT(hoist_reading_at(scene, 98).load_size_m.z(), 0) << "it is carried again";
  scene.motion.repeat_s = 0;
  EXPECT_EQ(gantry_at(scene.motion, 500), scene.motion.points.back());
}

TEST(Scenes, ReportUnknownMaterialAndMissingSize) {
  const test::TempFolder folder;
  std::ofstream(folder / "s.yaml")
      << "name: s\ncamera: {height_m: 2}\nmotion: {points: [{cart: 0, trolley: 0}]}\nfloor: grass\n"
         "obstacles:\n  - {name: a, kind: box, material: tin, x: 0, y: 0, height: 1}\n";
  const auto scene = read_scene(folder / "s.yaml");
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().text().find("'floor' names no material"), std::string::npos);
  EXPECT_NE(scene.error().text().find("'obstacles[0].size'"), std::string::npos);
}

TEST(Renderer, TheSameSeedGivesTheSameImageAndAnotherOneDoesNot) {
  Scene scene = small_scene("rig");
  const Image a = Renderer(scene).render(true, 0.3, 0.3, 0);
  const Image b = Renderer(scene).render(true, 0.3, 0.3, 0);
  EXPECT_EQ(a.bytes, b.bytes);
  scene.seed = 2;
  EXPECT_NE(Renderer(scene).render(true, 0.3, 0.3, 0).bytes, a.bytes);
}

TEST(Renderer, KnowsTheTrueHeightsAndDepths) {
  const Scene scene = small_scene("rig");
  const Renderer renderer(scene);
  EXPECT_NEAR(renderer.height_m(0.75, 0.55), 0.60, 1e-4);
  EXPECT_NEAR(renderer.height_m(-1, -1), 0, 1e-4);
  const std::vector<float> depth = renderer.depth(0.75, 0.55);
  EXPECT_NEAR(depth[45 * 160 + 80], 1.95 - 0.60, 1e-3);
  EXPECT_NEAR(depth[0], 1.95, 1e-3);
}

TEST(Simulate, WritesARecordingWithTruthWhosePositionsAreInterpolable) {
  const test::TempFolder folder;
  Scene scene = small_scene("lap");
  SimulateOptions options;
  options.folder = folder / "lap";
  options.max_frames = 5;
  options.truth_cell_m = 0.05;
  ASSERT_TRUE(simulate(scene, options));
  const auto recording = Recording::open(options.folder);
  ASSERT_TRUE(recording) << recording.error().text();
  EXPECT_EQ(recording->frames().size(), 5U);
  EXPECT_LT(recording->cart().front().time, recording->frames().front().time);
  EXPECT_GT(recording->cart().back().time, recording->frames().back().time);
  EXPECT_NEAR(recording->cart().front().distance_m, 0.3, 0.01);
  const auto truth = read_height_map(options.folder + "/truth/height_map.png");
  ASSERT_TRUE(truth) << truth.error().text();
  const auto obstacles = read_obstacles(options.folder + "/truth/obstacles.yaml");
  ASSERT_TRUE(obstacles);
  EXPECT_EQ(obstacles->size(), 5U);
}

TEST(Simulate, ARangefinderDelayShowsInTheReadings) {
  const test::TempFolder folder;
  Scene scene = small_scene("lap");
  scene.rangefinder.sigma_m = 0;
  scene.rangefinder.delay_ms = 200;
  scene.motion.speed_mps = 1;
  SimulateOptions options;
  options.folder = folder / "lap";
  options.max_frames = 6;
  options.truth_cell_m = 0.1;
  ASSERT_TRUE(simulate(scene, options));
  const auto recording = Recording::open(options.folder);
  const TimeNs end = recording->frames().back().time;  // 0.5 s after the start
  for (const RecordedDistance& d : recording->cart())
    if (std::abs(d.time - end) < 1'000'000) EXPECT_NEAR(d.distance_m, 0.3 + 0.3, 1e-3);
}

}  // namespace
}  // namespace crane
