#pragma once

#include <cstring>

#include <fastdds/dds/topic/TopicDataType.hpp>

namespace crane::dds {

/// Generated type support throws out of Fast CDR on malformed samples, and an exception in a
/// receiving thread ends the process. Here a bad sample is refused instead.
template <class PubSubType>
class GuardedType final : public PubSubType {
 public:
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    try {
      return PubSubType::deserialize(payload, data);
    } catch (...) {
      return false;
    }
  }

  /// Returning false here would hit an assertion of Fast DDS: a handle that belongs to no real
  /// instance lets the sample pass on to deserialize(), which refuses it.
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
              bool force_md5 = false) override {
    try {
      return PubSubType::getKey(data, handle, force_md5);
    } catch (...) {
      unsigned char* bytes = handle->value;
      std::memset(bytes, 0xEE, 16);
      return true;
    }
  }
};

}  // namespace crane::dds
