// SPDX-License-Identifier: Apache-2.0
// Every IDL type's deserialiser and key extraction behind its guard, then the validator.
#include <cstdint>
#include <cstring>
#include <memory>

#include "clearance_replyPubSubTypes.h"
#include "clearance_requestPubSubTypes.h"
#include "dds/guarded_type.hpp"
#include "dds/in_place_type.hpp"
#include "dds/validate.hpp"
#include "height_tilePubSubTypes.h"
#include "hoist_statePubSubTypes.h"
#include "map_statusPubSubTypes.h"
#include "map_tilePubSubTypes.h"
#include "octree_mapPubSubTypes.h"
#include "rangefinder_positionPubSubTypes.h"
#include "service_statusPubSubTypes.h"
#include "tile_requestPubSubTypes.h"
#include "zone_commandPubSubTypes.h"
#include "zone_setPubSubTypes.h"

namespace {

namespace v1 = crane::v1;

template <class PubSubType, class Type>
void decode(const std::uint8_t* data, std::size_t size) {
  static crane::dds::GuardedType<PubSubType> type;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(static_cast<std::uint32_t>(size + 1));
  std::memcpy(payload.data, data, size);
  payload.length = static_cast<std::uint32_t>(size);
  static Type sample;
  if (!type.deserialize(&payload, &sample)) return;
  (void)crane::dds::flaw(sample);
  eprosima::fastrtps::rtps::InstanceHandle_t handle;
  (void)type.getKey(&sample, &handle);
}

/// Whatever it says its images are, they must be within the payload: asan sees each byte.
template <class T>
void read_all(const crane::dds::Items<T>& items) {
  static volatile int sum = 0;
  for (const T& value : items) sum = sum + (value > 0 ? 1 : 0);
}
void read_images(const crane::dds::StereoFrame& s) {
  read_all(s.left());
  read_all(s.right());
}
void read_images(const crane::dds::PartialCloud& s) {
  read_all(s.depth());
  read_all(s.confidence());
  read_all(s.colour());
}
template <class Sample>
void decode_in_place(const std::uint8_t* data, std::size_t size) {
  static crane::dds::InPlaceType<Sample> type;
  static Sample sample;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(static_cast<std::uint32_t>(size));
  std::memcpy(payload.data, data, size);
  payload.length = static_cast<std::uint32_t>(size);
  const bool whole = type.deserialize(&payload, &sample);
  if (whole != (sample.broken() == nullptr)) __builtin_trap();
  if (!whole && crane::dds::flaw(sample) == nullptr) __builtin_trap();
  read_images(sample);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 5) return 0;
  const std::uint8_t which = data[0];
  ++data;
  --size;
  switch (which % 14) {
    case 0:
      decode<v1::RangefinderPositionPubSubType, v1::RangefinderPosition>(data, size);
      break;
    case 1:
      decode<v1::HoistStatePubSubType, v1::HoistState>(data, size);
      break;
    case 2:
      decode<v1::MapTilePubSubType, v1::MapTile>(data, size);
      break;
    case 3:
      decode<v1::HeightTilePubSubType, v1::HeightTile>(data, size);
      break;
    case 4:
      decode<v1::OctreeMapPubSubType, v1::OctreeMap>(data, size);
      break;
    case 7:
      decode<v1::ClearanceRequestPubSubType, v1::ClearanceRequest>(data, size);
      break;
    case 8:
      decode<v1::ClearanceReplyPubSubType, v1::ClearanceReply>(data, size);
      break;
    case 9:
      decode<v1::TileRequestPubSubType, v1::TileRequest>(data, size);
      break;
    case 10:
      decode<v1::ZoneSetPubSubType, v1::ZoneSet>(data, size);
      break;
    case 11:
      decode<v1::ZoneCommandPubSubType, v1::ZoneCommand>(data, size);
      break;
    case 5:
      decode<v1::MapStatusPubSubType, v1::MapStatus>(data, size);
      break;
    case 12:
      decode_in_place<crane::dds::StereoFrame>(data, size);
      break;
    case 13:
      decode_in_place<crane::dds::PartialCloud>(data, size);
      break;
    default:
      decode<v1::ServiceStatusPubSubType, v1::ServiceStatus>(data, size);
  }
  return 0;
}
