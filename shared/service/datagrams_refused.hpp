// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/drop_counts.hpp"
#include "service_status.h"

namespace crane {

/// How many datagrams a service's guard has refused since its start: all kinds together, the cause
/// `malformed datagram` of its service_status.
inline std::uint64_t datagrams_refused(const v1::ServiceStatus& status) {
  for (const v1::DropCount& entry : status.dropped())
    if (entry.code() == static_cast<std::uint32_t>(Cause::kMalformedDatagram)) return entry.count();
  return 0;
}

}  // namespace crane
