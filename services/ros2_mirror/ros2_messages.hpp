// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "crane/client/map.hpp"
#include "dds/ros2_topics.hpp"
#include "geometry/stereo_rig.hpp"

namespace crane::ros2 {

// What cranemap has, as ROS 2 says it (REP-103, -105, -117, -118). No DDS.

/// Frames: map -> crane_N/gantry (cart and trolley) -> crane_N/camera -> crane_N/camera_rectified.
struct Frames {
  std::string map = "map", gantry, camera, camera_rectified;
  explicit Frames(std::uint32_t crane);
};

/// Every `step`-th pixel of every `step`-th row as x, y, z [m], rgb; NaN where nothing matched.
sensor_msgs::msg::dds_::PointCloud2_ point_cloud(const dds::PartialCloud& cloud, std::uint32_t step,
                                                 const Frames& frames);
/// The left image as the camera gave it, where ROS has its encoding; else mono8 or bgr8. Error:
/// BadData.
Result<sensor_msgs::msg::dds_::Image_> image(const dds::StereoFrame& frame, const Frames& frames);
sensor_msgs::msg::dds_::CameraInfo_ camera_info(const CameraModel& camera, TimeNs time,
                                                const Frames& frames);
/// Error: BadData when the payload is no octree.
Result<octomap_msgs::msg::dds_::Octomap_> octomap(const v1::OctreeMap& map, const Frames& frames);
/// -1 unknown or stale, 0 floor, 100 obstacle.
nav_msgs::msg::dds_::OccupancyGrid_ occupancy_grid(const client::HeightGrid& grid, TimeNs time,
                                                   const Frames& frames);
/// Known columns as points x, y, height [m], at the middle of each.
sensor_msgs::msg::dds_::PointCloud2_ heights(const client::HeightGrid& grid, TimeNs time,
                                             const Frames& frames);
geometry_msgs::msg::dds_::TransformStamped_ transform(const std::string& parent,
                                                      const std::string& child, TimeNs time,
                                                      const Eigen::Isometry3d& T_parent_child);
diagnostic_msgs::msg::dds_::DiagnosticArray_ diagnostics(const std::vector<v1::ServiceStatus>& all,
                                                         const client::Status& map, TimeNs time,
                                                         std::uint32_t crane);

}  // namespace crane::ros2
