#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace crane {

/// Lets one stream through, and another one only once that has been silent for 3 s: two cameras, or
/// two rangefinders of one axis, are never mixed.
class StreamGate {
 public:
  using Clock = std::chrono::steady_clock;
  bool pass(std::uint64_t stream, Clock::time_point now = Clock::now()) {
    if (stream_ && *stream_ != stream && now - heard_ < std::chrono::seconds(3)) return false;
    stream_ = stream;
    heard_ = now;
    return true;
  }

 private:
  std::optional<std::uint64_t> stream_;
  Clock::time_point heard_{};
};

}  // namespace crane
