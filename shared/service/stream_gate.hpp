#pragma once

#include <chrono>
#include <cstdint>

namespace crane {

/// Lets one source through, and another one only once that has been silent for a while: two
/// cameras, two rangefinders of one axis or two controllers are never mixed.
template <class Source>
class SourceGate {
 public:
  using Clock = std::chrono::steady_clock;
  explicit SourceGate(std::chrono::milliseconds silence) : silence_(silence) {}

  bool pass(const Source& source, Clock::time_point now = Clock::now()) {
    if (any_ && source_ != source && now - heard_ < silence_) return false;
    any_ = true;
    source_ = source;
    heard_ = now;
    return true;
  }

 private:
  std::chrono::milliseconds silence_;
  bool any_ = false;
  Source source_{};
  Clock::time_point heard_{};
};

/// By the stream that a sample says it is of.
class StreamGate : public SourceGate<std::uint64_t> {
 public:
  StreamGate() : SourceGate(std::chrono::seconds(3)) {}
};

}  // namespace crane
