// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/transport/TransportDescriptorInterface.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>

#include "rtps_guard/guard.hpp"

namespace crane::dds {

/// Datagrams that were refused, by all transports of one participant.
struct GuardCounts {
  std::atomic<std::uint64_t> refused{0};
  std::array<std::atomic<std::uint64_t>, std::size_t(guard::Refusal::kCount)> by_refusal{};
  guard::Prefix self{};  ///< the participant's, set before has_self
  std::atomic<bool> has_self{false};
};

/// A transport that hands on only what the guard finds sound: Debian's Fast DDS can be ended by one
/// malformed datagram. Sending is untouched. `guard`: one for all transports of a participant, as
/// announcements and samples may come by different ones.
std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> guarded(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> transport,
    std::shared_ptr<GuardCounts> counts, std::shared_ptr<guard::Guard> guard);

}  // namespace crane::dds
