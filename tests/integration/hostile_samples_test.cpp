// SPDX-License-Identifier: Apache-2.0
// Malformed samples from a peer that speaks DDS but not our contract: no process ends, nothing
// malformed is handed out.

#include <gtest/gtest.h>

#include <cstring>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <random>

#include "clearance_replyPubSubTypes.h"
#include "clearance_requestPubSubTypes.h"
#include "dds/participant_impl.hpp"
#include "dds/validate.hpp"
#include "domain.hpp"
#include "height_tilePubSubTypes.h"
#include "hoist_statePubSubTypes.h"
#include "map_statusPubSubTypes.h"
#include "map_tilePubSubTypes.h"
#include "octree_mapPubSubTypes.h"
#include "partial_cloud.h"
#include "partial_cloudPubSubTypes.h"
#include "rangefinder_positionPubSubTypes.h"
#include "service_statusPubSubTypes.h"
#include "stereo_frame.h"
#include "stereo_framePubSubTypes.h"
#include "tile_requestPubSubTypes.h"
#include "zone_commandPubSubTypes.h"
#include "zone_setPubSubTypes.h"

namespace crane::dds {
namespace {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using test::eventually;

using Payload = std::vector<std::uint8_t>;

/// Writes any bytes under the name of any type.
class RawType final : public fdds::TopicDataType {
 public:
  RawType(const std::string& name, std::uint32_t max_size, bool keyed) {
    setName(name.c_str());
    m_typeSize = max_size + 4;
    m_isGetKeyDefined = keyed;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<Payload*>(data);
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* /*payload*/, void* /*data*/) override {
    return false;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<Payload*>(data)->size()); };
  }
  void* createData() override { return new Payload(); }
  void deleteData(void* data) override { delete static_cast<Payload*>(data); }
  bool getKey(void* data, rtps::InstanceHandle_t* handle, bool /*md5*/) override {
    const auto& bytes = *static_cast<Payload*>(data);
    unsigned char* value = handle->value;
    for (std::size_t i = 0; i < 16; ++i) value[i] = i < bytes.size() ? bytes[i] : 1;
    return true;
  }
};

/// A good sample of each type as its own serialiser writes it: what is mutated.
template <class PubSubType, class Type>
Payload serialised(const Type& sample) {
  PubSubType type;
  auto* data = const_cast<Type*>(&sample);
  rtps::SerializedPayload_t payload(type.getSerializedSizeProvider(data)() + 8);
  EXPECT_TRUE(type.serialize(data, &payload));
  return {payload.data, payload.data + payload.length};
}

Payload mutate(Payload bytes, std::mt19937& random) {
  const unsigned kind = random() % 4;
  if (kind == 0) {
    bytes.resize(4 + random() % bytes.size());
  } else if (kind == 1) {
    for (auto& b : bytes)
      if (random() % 8 == 0) b = static_cast<std::uint8_t>(random());
  } else if (kind == 2) {
    const std::size_t at = random() % bytes.size();
    for (std::size_t i = at; i < std::min(at + 4, bytes.size()); ++i) bytes[i] = 0xFF;
  } else {
    bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
  }
  return bytes;
}

template <class Topic, class PubSubType, class Sample>
void attack(const Sample& good_sample, int rounds) {
  SCOPED_TRACE(Topic::kName);
  const Payload good = serialised<PubSubType>(good_sample);
  // Zero-copy readers take their samples over the network too when the writer is no friend.
  auto victim = *Participant::create(test::settings(), "victim");
  Wakeup wakeup;
  auto reader = *Reader<Topic>::create(victim, &wakeup);
  auto attacker = *Participant::create(test::settings(), "attacker");
  auto& impl = attacker->impl();
  fdds::TypeSupport type(
      new RawType(PubSubType().getName(), 16U << 20U, PubSubType().m_isGetKeyDefined));
  type.register_type(impl.participant);
  auto* topic =
      impl.participant->create_topic(Topic::kName, type.get_type_name(), fdds::TOPIC_QOS_DEFAULT);
  ASSERT_NE(topic, nullptr);
  fdds::DataWriterQos qos;
  qos.reliability().kind = fdds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fdds::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().depth = 4;
  qos.resource_limits().max_samples = 4000;
  qos.resource_limits().max_instances = 1000;
  qos.resource_limits().max_samples_per_instance = 4;
  qos.resource_limits().allocated_samples = 1;
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  if (Topic::kQos.exclusive) qos.ownership().kind = fdds::EXCLUSIVE_OWNERSHIP_QOS;
  if (Topic::kQos.deadline_ms > 0) qos.deadline().period = {0, 100'000'000};
  if (Topic::kQos.liveliness_ms > 0) qos.liveliness().lease_duration = {1, 0};
  if (Topic::kQos.liveliness_ms > 0) qos.liveliness().announcement_period = {0, 300'000'000};
  qos.data_sharing().off();
  auto* writer = impl.publisher->create_datawriter(topic, qos);
  ASSERT_NE(writer, nullptr);
  ASSERT_TRUE(eventually([&] { return reader.counts().matched == 1; }));

  std::mt19937 random(4711);
  for (int i = 0; i < rounds; ++i) {
    Payload bytes = mutate(good, random);
    writer->write(&bytes);
    while (const auto sample = reader.take()) EXPECT_EQ(flaw(**sample), nullptr);
  }
  // Alive and well: a good sample still comes through.
  bool arrived = false;
  eventually([&] {
    Payload bytes = good;
    writer->write(&bytes);
    while (const auto sample = reader.take()) arrived |= flaw(**sample) == nullptr;
    return arrived;
  });
  EXPECT_TRUE(arrived);
  impl.publisher->delete_datawriter(writer);
}

template <class Tile>
Tile good_tile() {
  Tile t;
  t.crane(1);
  t.voxel_m(0.05);
  t.encoding(1);
  t.payload(std::vector<std::uint8_t>(300, 7));
  return t;
}

TEST(HostileSamples, KeyedTypes) {
  v1::RangefinderPosition position;
  position.crane(1);
  position.axis(1);
  position.time_ns(1);
  attack<RangefinderPositionTopic, v1::RangefinderPositionPubSubType>(position, 1000);
  attack<MapTileTopic, v1::MapTilePubSubType>(good_tile<v1::MapTile>(), 1000);
  attack<HeightTileTopic, v1::HeightTilePubSubType>(good_tile<v1::HeightTile>(), 1000);
}

TEST(HostileSamples, TypesWithStringsAndSequences) {
  v1::MapStatus status;
  status.crane(1);
  status.voxel_m(0.05);
  status.reason("fine");
  attack<MapStatusTopic, v1::MapStatusPubSubType>(status, 1000);
  v1::ServiceStatus service;
  service.crane(1);
  service.service(2);
  service.dropped().resize(3);
  service.stages().resize(3);
  attack<ServiceStatusTopic, v1::ServiceStatusPubSubType>(service, 1000);
  v1::OctreeMap octree;
  octree.crane(1);
  octree.voxel_m(0.05);
  octree.encoding(1);
  octree.payload(std::vector<std::uint8_t>(1000, 7));
  attack<OctreeMapTopic, v1::OctreeMapPubSubType>(octree, 1000);
}

TEST(HostileSamples, WhatControllersAndPlantsWrite) {
  v1::HoistState hoist;
  hoist.crane(1);
  hoist.time_ns(1);
  attack<HoistStateTopic, v1::HoistStatePubSubType>(hoist, 1000);
  v1::Zone zone;
  zone.id(3);
  zone.kind(v1::ZONE_NO_GO);
  zone.active(1);
  zone.z_max_m(2);
  zone.name("welding cell");
  for (const auto& [x, y] : {std::pair{0, 0}, {4, 0}, {4, 3}, {0, 3}}) {
    v1::ZoneCorner corner;
    corner.x_m(x);
    corner.y_m(y);
    zone.corners().push_back(corner);
  }
  v1::ZoneCommand command;
  command.crane(1);
  command.action(v1::ZONE_SET);
  command.zone(zone);
  attack<ZoneCommandTopic, v1::ZoneCommandPubSubType>(command, 1000);
  v1::ZoneSet set;
  set.crane(1);
  for (std::uint32_t id = 1; id <= 3; ++id) {
    zone.id(id);
    set.zones().push_back(zone);
  }
  attack<ZoneSetTopic, v1::ZoneSetPubSubType>(set, 1000);
  v1::TileRequest request;
  request.crane(1);
  request.time_ns(1);
  attack<TileRequestTopic, v1::TileRequestPubSubType>(request, 1000);
}

TEST(HostileSamples, ClearanceRequestsAndReplies) {
  v1::ClearanceRequest request;
  request.crane(1);
  request.path().resize(5);
  attack<ClearanceRequestTopic, v1::ClearanceRequestPubSubType>(request, 1000);
  v1::ClearanceReply reply;
  reply.crane(1);
  reply.text("an obstacle");
  attack<ClearanceReplyTopic, v1::ClearanceReplyPubSubType>(reply, 1000);
}

TEST(HostileSamples, ZeroCopyTypes) {
  auto frame = std::make_unique<v1::StereoFrame>();
  frame->encoding(1);
  frame->width(64);
  frame->height(64);
  frame->exposure_time_ns(1);
  frame->left().resize(64 * 64);
  frame->right().resize(64 * 64);
  attack<StereoFrameTopic, v1::StereoFramePubSubType>(*frame, 500);
  auto cloud = std::make_unique<v1::PartialCloud>();
  cloud->width(64);
  cloud->height(64);
  cloud->exposure_time_ns(1);
  cloud->f_px(700);
  cloud->baseline_m(0.1);
  cloud->sigma_disparity_px(0.2);
  cloud->depth().resize(64 * 64);
  cloud->confidence().resize(64 * 64);
  attack<PartialCloudTopic, v1::PartialCloudPubSubType>(*cloud, 500);
}

}  // namespace
}  // namespace crane::dds
