// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "rtps_guard/cursor.hpp"
#include "rtps_guard/refusal.hpp"

namespace crane::guard {

/// Parameters that somebody must look at more closely (DDSI-RTPS 2.3, 9.6.2.2.2).
enum Pid : std::uint16_t {
  kPidPad = 0x0000,
  kPidSentinel = 0x0001,
  kPidLease = 0x0002,
  kPidTopicName = 0x0005,
  kPidUnicastLocator = 0x002F,
  kPidMulticastLocator = 0x0030,
  kPidDefaultUnicast = 0x0031,
  kPidMetatrafficUnicast = 0x0032,
  kPidMetatrafficMulticast = 0x0033,
  kPidContentFilter = 0x0035,
  kPidDefaultMulticast = 0x0048,
  kPidParticipantGuid = 0x0050,
  kPidEndpointGuid = 0x005A,
  kPidTypeId = 0x0069,
  kPidKeyHash = 0x0070,
  kPidStatusInfo = 0x0071,
  kPidTypeObject = 0x0072,
  kPidTypeInformation = 0x0075,
  kPidDataSharing = 0x8006,
};

struct Parameter {
  std::uint16_t id = 0;
  Bytes value;
  std::size_t offset = 0;  ///< of the id, in what the list was read from
};

/// Reads one parameter and checks its size and content against its kind. False at the end of the
/// list or with a refusal. On the list are all parameters of RTPS 2.x, DDS Security and Fast DDS;
/// vendors' own (0x8000 and above) are let through unread, as receivers do not read them either.
class ParameterWalk {
 public:
  /// At the first parameter.
  explicit ParameterWalk(Cursor& cursor) : cursor_(cursor) {}

  bool next(Parameter& out);
  [[nodiscard]] Refusal refusal() const { return refusal_; }

 private:
  bool refuse(Refusal refusal) {
    refusal_ = refusal;
    return false;
  }
  Cursor& cursor_;
  Refusal refusal_ = Refusal::kNone;
  unsigned read_ = 0;
};

/// Of a checked string parameter, without its end.
std::string_view string_of(const Parameter& parameter, bool little);

}  // namespace crane::guard
