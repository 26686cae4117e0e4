#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <span>

namespace crane::dds {

/// Structure of one RTPS datagram (OMG DDSI-RTPS 2.3, 8.3 and 9.4) as far as a receiver relies on
/// it: header, submessage lengths, sequence number sets, inline QoS, fragments, parameter lists of
/// discovery. nullptr, or what is wrong. Reads every byte at most twice; takes no memory.
const char* rtps_flaw(std::span<const std::uint8_t> datagram);

/// The same with memory: fragments of one sample must agree on its size and on theirs.
/// Thread-safe; memory is bounded.
class RtpsCheck {
 public:
  const char* flaw(std::span<const std::uint8_t> datagram);

 private:
  struct Sample {
    std::array<std::uint8_t, 12> prefix{};
    std::uint32_t writer = 0;
    std::uint64_t number = 0;
    auto operator<=>(const Sample&) const = default;
  };
  struct Sizes {
    std::uint32_t sample = 0, fragment = 0;
    auto operator<=>(const Sizes&) const = default;
  };
  std::mutex mutex_;
  std::map<Sample, Sizes> fragmented_;
  std::array<Sample, 512> recent_{};  ///< a ring: the oldest is forgotten
  std::size_t next_ = 0;
};

}  // namespace crane::dds
