// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

#include "dds/endpoints.hpp"

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

/// For StreamGate: whether a process has no writer of this topic any more.
template <class Topic>
auto gone_from(const dds::Reader<Topic>& reader) {
  return [&reader](const dds::ParticipantId& id) { return !reader.writers().contains(id); };
}

/// By the stream that a sample says it is of. Another one begins at once where the old one cannot
/// go on: the process that it came from has begun it (a device was connected anew; never back to
/// the stream before, which would be two devices in turn), or has no writer any more.
class StreamGate {
 public:
  using Clock = std::chrono::steady_clock;

  /// `gone(writer)`: whether the process of the last stream has no writer any more; asked only
  /// then.
  template <class Gone>
  bool pass(std::uint64_t stream, const dds::ParticipantId& writer, Gone gone,
            Clock::time_point now = Clock::now()) {
    if (any_ && stream != stream_ && now - heard_ < kSilence) {
      const bool goes_on = writer == writer_ ? stream != before_ : gone(writer_);
      if (!goes_on) return false;
    }
    if (!any_ || stream != stream_) before_ = stream_;
    any_ = true;
    stream_ = stream;
    writer_ = writer;
    heard_ = now;
    return true;
  }

  static constexpr std::chrono::seconds kSilence{3};

 private:
  bool any_ = false;
  std::uint64_t stream_ = 0, before_ = 0;
  dds::ParticipantId writer_{};
  Clock::time_point heard_{};
};

}  // namespace crane
