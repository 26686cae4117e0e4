// SPDX-License-Identifier: Apache-2.0
#include "cloud/pcl_filters.hpp"

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace crane {
namespace {

using PclCloud = pcl::PointCloud<pcl::PointXYZRGB>;

PclCloud::Ptr to_pcl(const PointCloud& cloud) {
  auto out = std::make_shared<PclCloud>();
  out->reserve(cloud.size());
  for (const Point& p : cloud) {
    pcl::PointXYZRGB q;
    q.x = p.x;
    q.y = p.y;
    q.z = p.z;
    q.r = p.r;
    q.g = p.g;
    q.b = p.b;
    out->push_back(q);
  }
  return out;
}

PointCloud from_pcl(const PclCloud& cloud) {
  PointCloud out;
  out.reserve(cloud.size());
  for (const auto& p : cloud) out.push_back({p.x, p.y, p.z, p.r, p.g, p.b});
  return out;
}

Error failed(const std::string& where, const std::exception& e) {
  return {ErrorCode::kResource, where, e.what(), "check permissions and free space"};
}

}  // namespace

Result<PointCloud> remove_outliers(const PointCloud& cloud, int neighbours, double std_factor) {
  if (cloud.empty()) return PointCloud{};
  try {
    pcl::StatisticalOutlierRemoval<pcl::PointXYZRGB> filter;
    filter.setInputCloud(to_pcl(cloud));
    filter.setMeanK(neighbours);
    filter.setStddevMulThresh(std_factor);
    PclCloud kept;
    filter.filter(kept);
    return from_pcl(kept);
  } catch (const std::exception& e) {
    return failed("outlier removal", e);
  }
}

Result<PointCloud> voxel_grid(const PointCloud& cloud, double leaf_m) {
  if (cloud.empty()) return PointCloud{};
  double leaves = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = [axis](const Point& p) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; };
    const auto [low, high] = std::minmax_element(
        cloud.begin(), cloud.end(),
        [&value](const Point& a, const Point& b) { return value(a) < value(b); });
    leaves *= std::floor((value(*high) - value(*low)) / leaf_m) + 2;
  }
  if (!(leaves < std::numeric_limits<int>::max()))
    return Error{
        ErrorCode::kWrongSize, "voxel grid",
        "the cloud spans more leaves of " + std::to_string(leaf_m) + " m than PCL can count",
        "raise mapper.leaf_m, or use mapper.method: default"};
  try {
    pcl::VoxelGrid<pcl::PointXYZRGB> filter;
    filter.setInputCloud(to_pcl(cloud));
    const auto leaf = static_cast<float>(leaf_m);
    filter.setLeafSize(leaf, leaf, leaf);
    PclCloud kept;
    filter.filter(kept);
    return from_pcl(kept);
  } catch (const std::exception& e) {
    return failed("voxel grid", e);
  }
}

Result<void> write_pcd(const std::string& path, const PointCloud& cloud) {
  try {
    if (cloud.empty())
      return Error{ErrorCode::kNotAvailable, path, "there is no point to write", ""};
    if (pcl::io::savePCDFileBinary(path, *to_pcl(cloud)) == 0) return {};
  } catch (const std::exception& e) {
    return failed(path, e);
  }
  return Error{ErrorCode::kResource, path, "cannot be written", "check permissions and free space"};
}

Result<void> write_ply(const std::string& path, const PointCloud& cloud) {
  try {
    if (cloud.empty())
      return Error{ErrorCode::kNotAvailable, path, "there is no point to write", ""};
    if (pcl::io::savePLYFileBinary(path, *to_pcl(cloud)) == 0) return {};
  } catch (const std::exception& e) {
    return failed(path, e);
  }
  return Error{ErrorCode::kResource, path, "cannot be written", "check permissions and free space"};
}

Result<PointCloud> read_pcd(const std::string& path) {
  try {
    PclCloud cloud;
    if (pcl::io::loadPCDFile(path, cloud) == 0) return from_pcl(cloud);
  } catch (const std::exception& e) {
    return Error{ErrorCode::kBadData, path, e.what(), ""};
  }
  return Error{ErrorCode::kBadData, path, "is no PCD file", ""};
}

}  // namespace crane
