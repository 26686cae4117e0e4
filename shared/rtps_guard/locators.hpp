// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "rtps_guard/cursor.hpp"

namespace crane::guard {

/// IPv4, network order: 10.0.0.1 is 0x0A000001.
using Ipv4 = std::uint32_t;

/// Where a datagram came from.
struct Origin {
  Ipv4 address = 0;  ///< 0: not UDP over IPv4; addresses are not judged then
  bool this_host = false;
};

/// Addresses of this host's interfaces; the loopback network is always one.
class OwnAddresses {
 public:
  void set(std::vector<Ipv4> addresses) { addresses_ = std::move(addresses); }
  [[nodiscard]] bool has(Ipv4 address) const;

 private:
  std::vector<Ipv4> addresses_;
};

/// A place that somebody wants to be sent to.
struct Locator {
  enum Kind : std::int32_t { kUdp4 = 1, kTcp4 = 4, kSharedMemory = 16 };
  std::int32_t kind = 0;
  std::uint32_t port = 0;
  Ipv4 address = 0;
  Ipv4 wan = 0;        ///< TCP: of the router before it
  bool zeros = false;  ///< what an IPv4 locator leaves empty is so

  /// Of 24 bytes.
  Locator(Bytes value, bool little);
  [[nodiscard]] bool multicast() const { return address >> 28U == 0xE; }
};

/// Only the sender itself may be named (its host, if it is this one), or the group of RTPS: else a
/// third party is flooded through us. A host with several interfaces announces itself on each, and
/// keeps the address that reached us.
bool is_senders_own(const Locator& locator, const Origin& origin, const OwnAddresses& own);
/// 239.255.0.1 at the ports of this domain (DDSI-RTPS 9.6.1); of any if domain is negative.
bool is_group(const Locator& locator, int domain);

}  // namespace crane::guard
