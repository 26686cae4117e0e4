#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <span>

namespace crane::dds {

/// Structure of one RTPS datagram (OMG DDSI-RTPS 2.3, 8.3 and 9.4) as far as a receiver relies on
/// it: header, submessage lengths, sequence number sets, inline QoS, fragments, parameter lists of
/// discovery. nullptr, or what is wrong. Reads every byte at most twice; takes no memory.
const char* rtps_flaw(std::span<const std::uint8_t> datagram);

/// The same with memory: fragments of one sample must agree on its size and on theirs, and
/// participants that were not heard before are let through only so many a second: each costs Fast
/// DDS memory and time until its lease ends. Thread-safe; memory is bounded.
class RtpsCheck {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr double kNewcomersAtOnce = 200, kNewcomersPerSecond = 10;

  const char* flaw(std::span<const std::uint8_t> datagram);

 private:
  static constexpr std::size_t kParticipants = 1024;
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
  const char* fragment_flaw(std::span<const std::uint8_t> prefix, std::uint32_t writer,
                            std::uint64_t number, const Sizes& sizes);
  const char* newcomer_flaw(std::span<const std::uint8_t> prefix, Clock::time_point now);

  std::mutex mutex_;
  std::map<Sample, Sizes> fragmented_;
  std::array<Sample, 512> recent_{};  ///< a ring: the oldest is forgotten
  std::size_t next_ = 0;
  std::map<std::array<std::uint8_t, 12>, Clock::time_point> participants_;  ///< last heard
  double newcomers_ = kNewcomersAtOnce;
  Clock::time_point filled_ = Clock::now();
};

}  // namespace crane::dds
