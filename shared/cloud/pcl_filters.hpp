// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.hpp"
#include "cloud/point_cloud.hpp"

namespace crane {

/// PCL's StatisticalOutlierRemoval: a point goes when its mean distance to `neighbours` nearest
/// points exceeds the mean of all by `std_factor` standard deviations (paper: 50, 1.0 or 60, 0.8).
Result<PointCloud> remove_outliers(const PointCloud& cloud, int neighbours, double std_factor);

/// PCL's VoxelGrid: one mean point per cube of edge leaf_m.
/// Error: WrongSize when the cloud spans too many leaves for PCL, which would return it unfiltered.
Result<PointCloud> voxel_grid(const PointCloud& cloud, double leaf_m);

/// Binary PCD with colour, as pcl_viewer and CloudCompare open it. Error: Resource.
Result<void> write_pcd(const std::string& path, const PointCloud& cloud);
/// The same as binary PLY, for MeshLab, Blender and CloudCompare.
Result<void> write_ply(const std::string& path, const PointCloud& cloud);
/// Error: BadData.
Result<PointCloud> read_pcd(const std::string& path);

}  // namespace crane
