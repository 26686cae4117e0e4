// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <list>
#include <vector>

#include "rtps_guard/fragments.hpp"
#include "rtps_guard/message.hpp"

namespace crane::guard {

/// Handshake messages that come in parts, as their certificates are larger than some vendors'
/// fragments (Cyclone DDS: 1,344 bytes). Held back until they can be read as a whole. Bounded: 4
/// MB.
class Reassembly {
 public:
  static constexpr std::size_t kLargest = 60'000, kOpen = 64, kOpenOfOne = 2;

  /// A part, whose numbers fit each other and its bytes. `whole`: all of the sample, once it is
  /// there, until the next call; else empty.
  Refusal add(const Prefix& from, const Fragment& fragment, Bytes bytes, Bytes& whole);

 private:
  struct Open {
    Prefix from{};
    Fragment first_seen;
    std::vector<std::uint8_t> bytes;
    std::vector<bool> there;
    std::size_t missing = 0;
  };
  Open& open(const Prefix& from, const Fragment& fragment);

  std::list<Open> open_;  ///< the oldest first
  std::vector<std::uint8_t> whole_;
};

/// One message of one DATA, for all participants: `header` of 20 bytes with another source.
std::vector<std::uint8_t> data_message(Bytes header, const Prefix& source, std::uint32_t reader,
                                       std::uint32_t writer, std::uint64_t number, Bytes payload);

}  // namespace crane::guard
