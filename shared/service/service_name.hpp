// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "dds/service_numbers.hpp"

namespace crane {

/// Of v1::SERVICE_*, for people.
inline const char* service_name(std::uint32_t service) {
  switch (service) {
    case v1::SERVICE_CAMERA:
      return "camera";
    case v1::SERVICE_RANGEFINDER:
      return "rangefinder";
    case v1::SERVICE_STEREO:
      return "stereo";
    case v1::SERVICE_MAPPER:
      return "mapper";
    case v1::SERVICE_CLEARANCE:
      return "clearance";
    case v1::SERVICE_ROS2_MIRROR:
      return "ros2_mirror";
    case v1::SERVICE_STANDBY:
      return "standby";
    case v1::SERVICE_DISCOVERY:
      return "discovery";
    case dds::kServiceGateway:
      return "gateway";
    default:
      return "unknown";
  }
}

}  // namespace crane
