// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>

#include <fastdds/dds/topic/TopicDataType.hpp>

#include "bounds.h"

namespace crane::dds {

/// Whether a sample's key is one that this crane's samples have. Topics have room for a few
/// instances, and an instance stays as long as its writer: numbers that nobody uses would fill it,
/// and keep out who comes later. `crane`: 0 = any.
template <class Type>
bool has_known_key(const Type& sample, std::uint32_t crane) {
  if constexpr (requires { sample.crane(); })
    if (crane != 0 && sample.crane() != crane) return false;
  if constexpr (requires { sample.axis(); })
    if (sample.axis() > v1::AXIS_CART_SECOND) return false;
  if constexpr (requires { sample.service(); })
    if (sample.service() > v1::SERVICE_DISCOVERY) return false;
  return true;
}

/// Generated type support throws out of Fast CDR on malformed samples, and an exception in a
/// receiving thread ends the process. Here a bad sample is refused instead.
template <class PubSubType>
class GuardedType final : public PubSubType {
 public:
  explicit GuardedType(std::uint32_t crane = 0) : crane_(crane) {}

  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    try {
      return PubSubType::deserialize(payload, data);
    } catch (...) {
      return false;
    }
  }

  /// Returning false here would hit an assertion of Fast DDS: a handle that belongs to no real
  /// instance, one for all that have none, lets the sample pass on to deserialize() and take().
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
              bool force_md5 = false) override {
    try {
      bool known = true;
      if constexpr (requires { typename PubSubType::type; })
        known = has_known_key(*static_cast<const typename PubSubType::type*>(data), crane_);
      if (known) return PubSubType::getKey(data, handle, force_md5);
    } catch (...) {
      // as below
    }
    unsigned char* bytes = handle->value;
    std::memset(bytes, 0xEE, 16);
    return true;
  }

 private:
  std::uint32_t crane_;
};

}  // namespace crane::dds
