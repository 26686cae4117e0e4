// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/locators.hpp"

#include <algorithm>

namespace crane::guard {

bool OwnAddresses::has(Ipv4 address) const {
  return address >> 24U == 127 ||
         std::find(addresses_.begin(), addresses_.end(), address) != addresses_.end();
}

Locator::Locator(Bytes value, bool little) {
  Cursor c(value, little);
  kind = static_cast<std::int32_t>(c.u32());
  port = c.u32();
  Cursor network(value.subspan(8), false);
  zeros = network.u32() == 0;
  zeros = network.u32() == 0 && zeros;
  wan = network.u32();
  address = network.u32();
}

bool is_senders_own(const Locator& locator, const Origin& origin, const OwnAddresses& own) {
  if (locator.kind == Locator::kSharedMemory) return origin.this_host;
  if (locator.kind != Locator::kUdp4 && locator.kind != Locator::kTcp4) return false;
  if (locator.port == 0 || locator.multicast()) return false;
  if (locator.kind == Locator::kUdp4 && locator.wan != 0) return false;
  if (locator.wan != 0 && locator.wan != origin.address) return false;
  return locator.address == origin.address || (origin.this_host && own.has(locator.address));
}

bool is_group(const Locator& locator, int domain) {
  constexpr Ipv4 kGroup = 0xEFFF0001;
  if (locator.kind != Locator::kUdp4 || locator.address != kGroup) return false;
  const std::uint32_t first = 7400 + 250 * static_cast<std::uint32_t>(domain);
  return domain < 0 || locator.port == first || locator.port == first + 1;
}

}  // namespace crane::guard
