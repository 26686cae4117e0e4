// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "base/loop_watch.hpp"
#include "crane/client/map.hpp"
#include "map_sync/map_follower.hpp"

namespace crane::client {

/// All tiles of a large hall may arrive at once.
inline constexpr std::chrono::seconds kTurnsWithin{10};

/// What is asked for, or `none` when there is no memory for it.
template <class Answer, class Ask>
Answer answer_or(const Answer& none, const Ask& ask) noexcept {
  try {
    return ask();
  } catch (...) {
    return none;
  }
}

inline constexpr const char* kOutOfMemory =
    "out of memory";  // so short that a string of it takes none

struct Map::Impl {
  Wakeup wakeup;  ///< outlives those that tell it
  std::unique_ptr<MapFollower> follower;

  std::mutex callback_mutex;
  /// Shared with the call that is going on, which may replace it.
  std::shared_ptr<const std::function<void(const Update&)>> callback;
  std::atomic<std::thread::id> calling{};

  std::atomic<bool> stop{false};
  const LoopWatch::Mark turning = LoopWatch::of_process().watch("map follower", kTurnsWithin);
  std::thread thread;

  static std::unique_ptr<Map> follow(const Result<std::shared_ptr<dds::Participant>>& participant,
                                     const MapOptions& options, std::string& error);
  ~Impl();
  void run();
  void tell(const std::vector<TileKey>& changed);
};

}  // namespace crane::client
