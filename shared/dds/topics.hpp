// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <tuple>

#include "bounds.h"
#include "clearance_reply.h"
#include "clearance_request.h"
#include "dds/image_samples.hpp"
#include "height_tile.h"
#include "hoist_state.h"
#include "map_status.h"
#include "map_tile.h"
#include "octree_map.h"
#include "rangefinder_position.h"
#include "service_status.h"
#include "tile_request.h"
#include "zone_command.h"
#include "zone_set.h"

namespace crane::dds {

/// The part of DDS QoS that belongs to a topic. Nothing outside this header changes it;
/// XML profiles set transport, discovery and security only.
struct QosSpec {
  bool reliable = true;
  bool transient_local = false;  ///< late joiners get the last `depth` samples of each instance
  int depth = 1;                 ///< keep-last
  int max_instances = 1;
  int deadline_ms = 0;     ///< 0 = none
  int lifespan_ms = 0;     ///< 0 = none
  int liveliness_ms = 0;   ///< automatic liveliness lease; 0 = infinite
  bool zero_copy = false;  ///< data-sharing with loans between processes of one host
  bool big = false;        ///< payload memory is taken when needed, not in advance
  bool unbounded = false;  ///< of a type without bounds, unkeyed: ROS 2's
  bool exclusive = false;  ///< of several writers only the strongest is heard: what a mapper says
  bool disposes = false;   ///< instances end: readers are handed their keys
};

// One row per topic: type, name, QoS. A contract test compares this with idl/README.md and the IDL.

struct StereoFrameTopic {
  using Type = StereoFrame;
  static constexpr const char* kName = "crane/v1/stereo_frame";
  // 0.8 s at 10 Hz: what a busy host may fall behind before a frame is overwritten.
  static constexpr QosSpec kQos{.depth = 8, .lifespan_ms = 2000, .zero_copy = true};
};
struct RangefinderPositionTopic {
  using Type = v1::RangefinderPosition;
  static constexpr const char* kName = "crane/v1/rangefinder_position";
  static constexpr QosSpec kQos{.depth = 256, .max_instances = 16, .deadline_ms = 200};
};
struct HoistStateTopic {
  using Type = v1::HoistState;
  static constexpr const char* kName = "crane/v1/hoist_state";
  static constexpr QosSpec kQos{.depth = 64, .max_instances = 16, .deadline_ms = 300};
};
struct PartialCloudTopic {
  using Type = PartialCloud;
  static constexpr const char* kName = "crane/v1/partial_cloud";
  static constexpr QosSpec kQos{.depth = 4, .lifespan_ms = 2000, .zero_copy = true};
};
struct MapTileTopic {
  using Type = v1::MapTile;
  static constexpr const char* kName = "crane/v1/map_tile";
  static constexpr QosSpec kQos{.transient_local = true,
                                .max_instances = 200'000,
                                .big = true,
                                .exclusive = true,
                                .disposes = true};
};
struct HeightTileTopic {
  using Type = v1::HeightTile;
  static constexpr const char* kName = "crane/v1/height_tile";
  static constexpr QosSpec kQos{
      .transient_local = true, .max_instances = 100'000, .big = true, .exclusive = true};
};
struct OctreeMapTopic {
  using Type = v1::OctreeMap;
  static constexpr const char* kName = "crane/v1/octree_map";
  static constexpr QosSpec kQos{
      .transient_local = true, .max_instances = 16, .big = true, .exclusive = true};
};
struct MapStatusTopic {
  using Type = v1::MapStatus;
  static constexpr const char* kName = "crane/v1/map_status";
  static constexpr QosSpec kQos{.transient_local = true,
                                .max_instances = 16,
                                .deadline_ms = 1000,
                                .liveliness_ms = 2000,
                                .exclusive = true};
};
struct TileRequestTopic {
  using Type = v1::TileRequest;
  static constexpr const char* kName = "crane/v1/tile_request";
  static constexpr QosSpec kQos{.depth = 64, .max_instances = 16, .lifespan_ms = 2000};
};
struct ZoneSetTopic {
  using Type = v1::ZoneSet;
  static constexpr const char* kName = "crane/v1/zone_set";
  static constexpr QosSpec kQos{
      .transient_local = true, .max_instances = 16, .big = true, .exclusive = true};
};
struct ZoneCommandTopic {
  using Type = v1::ZoneCommand;
  static constexpr const char* kName = "crane/v1/zone_command";
  static constexpr QosSpec kQos{.depth = 64, .max_instances = 16, .big = true};
};
struct ClearanceRequestTopic {
  using Type = v1::ClearanceRequest;
  static constexpr const char* kName = "crane/v1/clearance_request";
  static constexpr QosSpec kQos{.depth = 64, .max_instances = 16, .lifespan_ms = 2000};
};
struct ClearanceReplyTopic {
  using Type = v1::ClearanceReply;
  static constexpr const char* kName = "crane/v1/clearance_reply";
  static constexpr QosSpec kQos{.depth = 64, .max_instances = 16, .lifespan_ms = 2000};
};
struct ServiceStatusTopic {
  using Type = v1::ServiceStatus;
  static constexpr const char* kName = "crane/v1/service_status";
  static constexpr QosSpec kQos{.transient_local = true, .max_instances = 64, .big = true};
};

using AllTopics = std::tuple<StereoFrameTopic, RangefinderPositionTopic, HoistStateTopic,
                             PartialCloudTopic, MapTileTopic, HeightTileTopic, OctreeMapTopic,
                             MapStatusTopic, TileRequestTopic, ZoneSetTopic, ZoneCommandTopic,
                             ClearanceRequestTopic, ClearanceReplyTopic, ServiceStatusTopic>;

}  // namespace crane::dds
