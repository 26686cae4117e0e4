// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "crane/client/map.hpp"
#include "dds/topics.hpp"
#include "geometry/stereo_rig.hpp"
#include "map_codec/octomap_file.hpp"

namespace crane::gateway::foxglove {

// Ours as Foxglove's schemas have it: JSON, bytes as base64, little-endian. Frames: "map", "camera"
// (the left one: x right, y down, z forward), "hook", "load".

struct Transform {
  std::string parent, child;
  Eigen::Isometry3d T_parent_child = Eigen::Isometry3d::Identity();
};
std::string frame_transforms(TimeNs time, const std::vector<Transform>& transforms);

enum class Level { kInfo = 2, kWarning = 3, kError = 4 };
std::string log_line(TimeNs time, Level level, const std::string& name, const std::string& message);

/// foxglove.PointCloud of the points that are evidence, so many of a row and so many rows left out
/// that there are no more than `most`: float32 x, y, z [m, camera], uint8 confidence, and uint8
/// red, green, blue, alpha where the cloud has colour.
std::string point_cloud(const dds::PartialCloud& cloud, std::size_t most);

/// foxglove.Grid: float32 height [m] (NaN: not known), uint8 surface (0 unknown, 1 floor, 2
/// obstacle, 3 stale), uint8 lower_bound. More than `most` cells are put together, n x n each: the
/// highest of those that are known, a lower bound if any is one, or is not known.
std::string grid(const client::HeightGrid& heights, TimeNs time, std::size_t most);

/// foxglove.VoxelGrid: uint8 occupancy, 0 unknown, 1 free, 2 occupied. More than `most` cells are
/// put together, n x n x n each: occupied if any is, free only if all are. Error: NotAvailable for
/// a map without a surface.
Result<std::string> voxel_grid(const OctomapFile& map, TimeNs time, std::size_t most);

/// foxglove.CompressedImage: JPEG of the left image, at most `most_px` wide. Error: BadData.
Result<std::string> left_image(const dds::StereoFrame& frame, int most_px);

}  // namespace crane::gateway::foxglove
