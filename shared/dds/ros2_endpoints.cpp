// SPDX-License-Identifier: Apache-2.0
// Writers of ROS 2's types. A library of its own: only the mirror has them.

#include "dds/ros2_topics.hpp"
#include "dds/writer_impl.hpp"
#include "ros2PubSubTypes.h"

namespace crane::dds {

template <>
struct Support<sensor_msgs::msg::dds_::PointCloud2_> {
  using PubSubType = sensor_msgs::msg::dds_::PointCloud2_PubSubType;
};
template <>
struct Support<sensor_msgs::msg::dds_::Image_> {
  using PubSubType = sensor_msgs::msg::dds_::Image_PubSubType;
};
template <>
struct Support<sensor_msgs::msg::dds_::CameraInfo_> {
  using PubSubType = sensor_msgs::msg::dds_::CameraInfo_PubSubType;
};
template <>
struct Support<octomap_msgs::msg::dds_::Octomap_> {
  using PubSubType = octomap_msgs::msg::dds_::Octomap_PubSubType;
};
template <>
struct Support<nav_msgs::msg::dds_::OccupancyGrid_> {
  using PubSubType = nav_msgs::msg::dds_::OccupancyGrid_PubSubType;
};
template <>
struct Support<tf2_msgs::msg::dds_::TFMessage_> {
  using PubSubType = tf2_msgs::msg::dds_::TFMessage_PubSubType;
};
template <>
struct Support<diagnostic_msgs::msg::dds_::DiagnosticArray_> {
  using PubSubType = diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType;
};

template class Writer<ros2::PointCloudTopic>;
template class Writer<ros2::ImageTopic>;
template class Writer<ros2::CameraInfoTopic>;
template class Writer<ros2::OctomapTopic>;
template class Writer<ros2::OccupancyGridTopic>;
template class Writer<ros2::HeightsTopic>;
template class Writer<ros2::TfTopic>;
template class Writer<ros2::TfStaticTopic>;
template class Writer<ros2::DiagnosticsTopic>;

}  // namespace crane::dds
