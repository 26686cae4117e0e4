// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dds/topics.hpp"
#include "ros2.h"

namespace crane::dds::ros2 {

// What the mirror writes, by ROS 2's conventions: names `rt/...` (the crane's namespace comes with
// the writer), types pkg::msg::dds_::Name_, no keys, no partition, reliable, so that best-effort
// readers match as well.

struct PointCloudTopic {
  using Type = sensor_msgs::msg::dds_::PointCloud2_;
  static constexpr const char* kName = "rt/points";
  static constexpr QosSpec kQos{.depth = 2, .unbounded = true};
};
struct ImageTopic {
  using Type = sensor_msgs::msg::dds_::Image_;
  static constexpr const char* kName = "rt/image_raw";
  static constexpr QosSpec kQos{.depth = 2, .unbounded = true};
};
struct CameraInfoTopic {
  using Type = sensor_msgs::msg::dds_::CameraInfo_;
  static constexpr const char* kName = "rt/camera_info";
  static constexpr QosSpec kQos{.depth = 2, .unbounded = true};
};
struct OctomapTopic {
  using Type = octomap_msgs::msg::dds_::Octomap_;
  static constexpr const char* kName = "rt/octomap_binary";
  static constexpr QosSpec kQos{.transient_local = true, .unbounded = true};
};
struct OccupancyGridTopic {
  using Type = nav_msgs::msg::dds_::OccupancyGrid_;
  static constexpr const char* kName = "rt/occupancy_grid";
  static constexpr QosSpec kQos{.transient_local = true, .unbounded = true};
};
struct HeightsTopic {
  using Type = sensor_msgs::msg::dds_::PointCloud2_;
  static constexpr const char* kName = "rt/heights";
  static constexpr QosSpec kQos{.transient_local = true, .unbounded = true};
};
struct TfTopic {
  using Type = tf2_msgs::msg::dds_::TFMessage_;
  static constexpr const char* kName = "rt/tf";
  static constexpr QosSpec kQos{.depth = 100, .unbounded = true};
};
struct TfStaticTopic {
  using Type = tf2_msgs::msg::dds_::TFMessage_;
  static constexpr const char* kName = "rt/tf_static";
  static constexpr QosSpec kQos{.transient_local = true, .unbounded = true};
};
struct DiagnosticsTopic {
  using Type = diagnostic_msgs::msg::dds_::DiagnosticArray_;
  static constexpr const char* kName = "rt/diagnostics";
  static constexpr QosSpec kQos{.depth = 10, .unbounded = true};
};

}  // namespace crane::dds::ros2
