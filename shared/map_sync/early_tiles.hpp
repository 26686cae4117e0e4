// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <utility>
#include <vector>

#include "dds/endpoints.hpp"

namespace crane {

/// Tiles of writers that nobody knows yet: a mapper that begins may publish before its first
/// heartbeat is heard. They wait for it, a moment and in bounded room; the oldest give way, as they
/// come again when they are asked for.
template <class Sample>
class EarlyTiles {
 public:
  using Steady = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kWait{2};
  static constexpr std::size_t kRoomBytes = 16U << 20U;

  /// Returns how many others gave way.
  std::size_t add(const dds::ParticipantId& writer, const Sample& sample, Steady::time_point now) {
    waiting_.push_back({writer, sample, now});
    bytes_ += cost(sample);
    std::size_t gone = 0;
    for (; bytes_ > kRoomBytes; ++gone) pop();
    return gone;
  }
  /// Returns how many have waited in vain.
  std::size_t end_waits(Steady::time_point now) {
    std::size_t gone = 0;
    for (; !waiting_.empty() && now - waiting_.front().since > kWait; ++gone) pop();
    return gone;
  }
  /// Those of a writer that is known now, in their order.
  std::vector<Sample> take(const dds::ParticipantId& writer) {
    std::vector<Sample> out;
    std::deque<Waiting> others;
    for (Waiting& w : waiting_) {
      if (w.writer != writer) {
        others.push_back(std::move(w));
        continue;
      }
      bytes_ -= cost(w.sample);
      out.push_back(std::move(w.sample));
    }
    waiting_ = std::move(others);
    return out;
  }

  /// Takes no memory, not even to begin anew.
  void clear() noexcept {
    waiting_.clear();
    bytes_ = 0;
  }

 private:
  struct Waiting {
    dds::ParticipantId writer;
    Sample sample;
    Steady::time_point since;
  };
  static std::size_t cost(const Sample& sample) {
    return sizeof(Waiting) + sample.payload().size();
  }
  void pop() {
    bytes_ -= cost(waiting_.front().sample);
    waiting_.pop_front();
  }

  std::deque<Waiting> waiting_;
  std::size_t bytes_ = 0;
};

}  // namespace crane
