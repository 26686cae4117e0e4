// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rtps_guard/guard.hpp"
#include "rtps_guard/submessages.hpp"

namespace crane::guard {

// Of the files guard_*.cpp only.

struct Guard::Message {
  Ipv4 source = 0;
  Clock::time_point now;
  Sender sender;
  Participant* participant = nullptr;
  std::uint16_t vendor = 0;
  bool elsewhere = false;  ///< INFO_DST: for another participant
  bool decrypted = false;  ///< within a signed part: made by an authenticated peer
  Patches& patches;
  std::vector<std::uint8_t>& assembled;
  Bytes header;
};

struct Guard::Disposal {
  bool disposed = false;  ///< 1 disposed, 2 unregistered, 3 both: Fast DDS knows nothing else
  Prefix subject{};
  std::uint32_t entity = 0;

  void of(Bytes guid) {
    std::copy_n(guid.begin(), subject.size(), subject.begin());
    entity = guard::entity(guid.subspan(12));
  }
};

}  // namespace crane::guard
