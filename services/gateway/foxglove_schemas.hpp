// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/foxglove_channels.hpp"
#include "gateway/json.hpp"

namespace crane::gateway {

/// What the protocol's "advertise" says of all channels: topic, name of the schema, and the schema.
/// Messages are JSON, bytes in them base64; the schemas are those of Foxglove's @foxglove/schemas.
Json foxglove_advertisement();

inline std::uint32_t id_of(Channel channel) {
  return static_cast<std::uint32_t>(channel) + 1;
}

}  // namespace crane::gateway
