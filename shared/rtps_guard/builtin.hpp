// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rtps_guard/locators.hpp"
#include "rtps_guard/message.hpp"
#include "rtps_guard/patches.hpp"

namespace crane::guard {

/// Built-in writers (DDSI-RTPS 9.3.1.3, DDS Security 7.3.6), as 4 bytes big-endian.
enum Entity : std::uint32_t {
  kParticipants = 0x000100C2,
  kTopics = 0x000002C2,
  kPublications = 0x000003C2,
  kSubscriptions = 0x000004C2,
  kLiveliness = 0x000200C2,
  kHandshake = 0x000201C3,
  kSecurePublications = 0xFF0003C2,
  kSecureSubscriptions = 0xFF0004C2,
  kSecureLiveliness = 0xFF0200C2,
  kSecureParticipants = 0xFF0101C2,
  kKeyExchange = 0xFF0202C3,  ///< always encrypted
};

inline bool is_builtin(std::uint32_t entity) {
  return (entity & 0xC0U) == 0xC0U;
}
inline bool announces_participants(std::uint32_t writer) {
  return writer == kParticipants || writer == kSecureParticipants;
}
inline bool announces_endpoints(std::uint32_t writer) {
  return writer == kPublications || writer == kSubscriptions || writer == kSecurePublications ||
         writer == kSecureSubscriptions;
}

/// Who sent it, and who may be named in it.
struct Sender {
  Prefix prefix{};
  Origin origin;
  bool relay = false;  ///< a discovery server: announces others
};

/// What an announcement says that is remembered.
struct Announcement {
  Prefix subject{};          ///< of whom it speaks
  std::uint32_t entity = 0;  ///< an endpoint's
  std::string topic;
  std::uint32_t lease_seconds = 0;
  std::vector<Ipv4> addresses;  ///< that it named for itself, before others' were taken out
  bool named_own_address = false, named_any_address = false;
};

struct BuiltinContext {
  const Sender& sender;
  const OwnAddresses& own;
  int domain = -1;
};

/// A payload with its encoding of 4 bytes, of a built-in writer, read whole; offset is that of the
/// payload in the datagram. What stays in Fast DDS's reach of an announcement: a lease of a second
/// to a minute, the sender's own addresses; no type and no filter, which nobody here uses and whose
/// readers recurse.
Refusal read_builtin(std::uint32_t writer, Bytes payload, std::size_t offset,
                     const BuiltinContext& context, Announcement& out, Patches& patches);

/// A key hash of a built-in writer: whose?
Refusal check_subject(Bytes guid, const Sender& sender);

}  // namespace crane::guard
