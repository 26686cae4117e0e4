// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "cloud/pcl_filters.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

PointCloud plane(int n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> at(0, 1);
  PointCloud cloud;
  for (int i = 0; i < n; ++i) cloud.push_back({at(random), at(random), 0, 10, 20, 30});
  return cloud;
}

TEST(OutlierRemoval, TakesAPointFarFromAllOthers) {
  PointCloud cloud = plane(2000);
  cloud.push_back({0.5F, 0.5F, 3, 0, 0, 0});
  const auto kept = remove_outliers(cloud, 50, 1.0);
  ASSERT_TRUE(kept);
  for (const Point& p : *kept) EXPECT_LT(p.z, 1);
  EXPECT_GT(kept->size(), 1500U);
}

TEST(VoxelGrid, LeavesOnePointPerCube) {
  const auto kept = voxel_grid(plane(20'000), 0.1);
  ASSERT_TRUE(kept);
  EXPECT_LE(kept->size(), 121U);
  EXPECT_GE(kept->size(), 100U);
}

TEST(VoxelGrid, RefusesWhatPclWouldReturnUnfiltered) {
  PointCloud cloud = plane(100);
  cloud.push_back({1e5F, 1e5F, 1e5F, 0, 0, 0});
  const auto kept = voxel_grid(cloud, 0.01);
  ASSERT_FALSE(kept);
  EXPECT_EQ(kept.error().code, ErrorCode::kWrongSize);
}

TEST(Pcd, RoundTripsWithColour) {
  const test::TempFolder folder;
  ASSERT_TRUE(write_pcd(folder / "a.pcd", plane(10)));
  const auto back = read_pcd(folder / "a.pcd");
  ASSERT_TRUE(back);
  ASSERT_EQ(back->size(), 10U);
  EXPECT_EQ((*back)[3].g, 20);
  EXPECT_FALSE(write_pcd("/nowhere/a.pcd", plane(10)));
  EXPECT_FALSE(read_pcd("/nowhere/a.pcd"));
}

}  // namespace
}  // namespace crane
