// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace crane {

/// When a subscriber asks for what it lacks: not while tiles still come, and less and less often
/// when asking does not help, because all that a mapper answers goes to everybody. The clock is
/// passed in. One thread.
class Resync {
 public:
  using Clock = std::chrono::steady_clock;
  /// Nothing has come for so long, and still it is not complete: something was lost.
  static constexpr std::chrono::milliseconds kAfter{700};
  /// What could not be held is not asked for sooner.
  static constexpr std::chrono::seconds kRest{30};
  /// Asked so often in vain, more is held than the mapper has, or what it has no longer: that
  /// cannot be asked for, so all goes, and is asked for.
  static constexpr int kUntilAnew = 3;

  void arrived(Clock::time_point now) { moved_at_ = now; }
  void whole(Clock::time_point now) {
    moved_at_ = now;
    in_vain_ = 0;
  }
  /// Another map: its tiles are on their way.
  void begins(Clock::time_point now) {
    whole(now);
    rest_until_ = {};
  }
  /// There is no room or no memory for it.
  void rests(Clock::time_point now) { rest_until_ = now + kRest; }

  enum class Ask { kNot, kForWhatLacks, kForAll };
  /// `heard_at`: the last heartbeat; nobody answers who is not alive.
  Ask due(Clock::time_point now, Clock::time_point heard_at);

 private:
  Clock::time_point moved_at_{}, asked_at_{}, rest_until_{};
  int in_vain_ = 0;
};

}  // namespace crane
