// SPDX-License-Identifier: Apache-2.0
#include "mapping/sighting.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "mapping/projective_integrator.hpp"

namespace crane {
namespace {

constexpr double kVoxel = 0.05, kCamera = 2;

/// What stands below a camera 2 m up: its height by map x [m].
using Heights = std::function<double(double x_m)>;

class Sightings : public testing::Test {
 protected:
  /// One frame of it, every depth as uncertain as `sigma_m` at the floor.
  void see(const Heights& heights, double sigma_m, int times = 1) {
    constexpr std::uint32_t kWidth = 320, kHeight = 240;
    DepthFrame f;
    f.width = kWidth;
    f.height = kHeight;
    f.f_px = 300;
    f.cx_px = (kWidth - 1) / 2.0;
    f.cy_px = (kHeight - 1) / 2.0;
    f.baseline_m = 0.12;
    f.sigma_disparity_px = sigma_m * f.f_px * f.baseline_m / (kCamera * kCamera);
    f.T_map_rectified.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    f.T_map_rectified.translation() = Eigen::Vector3d(0, 0, kCamera);
    std::vector<float> depth(std::size_t{kWidth} * kHeight);
    const std::vector<std::uint8_t> confidence(depth.size(), 255);
    for (std::uint32_t v = 0; v < kHeight; ++v)
      for (std::uint32_t u = 0; u < kWidth; ++u) {
        const double slope = (u - f.cx_px) / f.f_px;
        double z = kCamera;
        for (int i = 0; i < 3; ++i) z = kCamera - heights(slope * z);
        depth[std::size_t(v) * kWidth + u] = static_cast<float>(z);
      }
    f.depth_m = depth.data();
    f.confidence = confidence.data();
    for (int i = 0; i < times; ++i) integrator_.integrate(f, ++time_, map_);
  }
  void see(double height_m, double sigma_m, int times = 1) {
    see([height_m](double) { return height_m; }, sigma_m, times);
  }
  /// Of the voxel at this height in the column x in [0, 0.05).
  [[nodiscard]] Occupancy at(double height_m) const { return map_.at(0, 0, map_.index(height_m)); }
  [[nodiscard]] double surface_m(double height_m) const {
    const int z = map_.index(height_m);
    const Block& block = *map_.find({0, 0})->blocks.at(tile_of(z));
    return map_.surface_height_m(block, in_tile(z) * kTileColumns, z);
  }

  OccupancyMap map_{kVoxel, 1U << 28U};
  ProjectiveIntegrator integrator_{{-0.5, 1.8}};
  TimeNs time_ = 0;
};

TEST_F(Sightings, UncertainOnesGatherWhereTheirMeanLies) {
  see(0.12, 0.08);  // a voxel and a half too high
  see(0.02, 0.08, 12);
  EXPECT_EQ(at(0.02), Occupancy::kOccupied);
  EXPECT_NEAR(surface_m(0.02), 0.03, 0.012);
  EXPECT_EQ(at(0.07), Occupancy::kUnknown);
  EXPECT_EQ(at(0.12), Occupancy::kUnknown);
}

TEST_F(Sightings, TheLessCertainTheMoreAreNeededAndAllAddUp) {
  see(0.02, 0.24, 10);
  EXPECT_EQ(at(0.02), Occupancy::kUnknown);
  see(0.02, 0.24, 10);
  EXPECT_EQ(at(0.02), Occupancy::kOccupied) << "as when the crane stands";
}

TEST_F(Sightings, ACertainSurfaceStaysAsItIs) {
  see(0.12, 0.005);
  see(0.02, 0.08, 20);
  EXPECT_EQ(at(0.12), Occupancy::kOccupied);
  EXPECT_NEAR(surface_m(0.12), 0.12, 0.001);
}

TEST_F(Sightings, ACertainOneBeginsTheMeanOfUncertainOnesAnew) {
  see(0.09, 0.06, 6);
  see(0.06, 0.005);
  EXPECT_NEAR(surface_m(0.06), 0.06, 0.001);
}

TEST_F(Sightings, ACertainOneContradictsWhatWasBelievedJustAboveButFreesNothing) {
  see(0.07, 0.03);
  ASSERT_EQ(at(0.07), Occupancy::kOccupied);
  // Beside a wall no ray is known to pass so low.
  const Heights beside_a_wall = [](double x) { return x < 0 ? 0.5 : 0.02; };
  see(beside_a_wall, 0.005, 6);
  EXPECT_EQ(at(0.02), Occupancy::kOccupied);
  EXPECT_EQ(at(0.07), Occupancy::kUnknown);
}

TEST_F(Sightings, AnEdgeWithinAColumnContradictsNothing) {
  const Heights edge = [](double x) { return x < 0.025 ? 0.09 : 0.01; };
  see(edge, 0.005, 6);
  EXPECT_EQ(at(0.09), Occupancy::kOccupied);
}

TEST_F(Sightings, WhatMovedTakesNothingFromACertainSurface) {
  see(0.02, 0.005, 3);
  see(0.3, 0.08);  // nothing within its reach: one of its own
  see(0.02, 0.08, 12);
  EXPECT_EQ(at(0.02), Occupancy::kOccupied);
  EXPECT_NEAR(surface_m(0.02), 0.02, 0.003);
}

}  // namespace
}  // namespace crane
