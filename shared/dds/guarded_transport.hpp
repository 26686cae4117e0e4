#pragma once

#include <fastdds/rtps/transport/TransportDescriptorInterface.h>

#include <atomic>
#include <cstdint>
#include <memory>

namespace crane::dds {

/// Datagrams that were refused, by all transports of one participant.
struct GuardCounts {
  std::atomic<std::uint64_t> refused{0};
};

/// A transport that hands on only what RtpsCheck finds sound: Debian's Fast DDS can be ended by one
/// malformed datagram. Sending is untouched.
std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> guarded(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> transport,
    std::shared_ptr<GuardCounts> counts);

}  // namespace crane::dds
