// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

#include "base/clock.hpp"

namespace crane {

/// Both clocks of one moment [ns].
struct ClockPair {
  TimeNs monotonic = 0, epoch = 0;
};

/// Turns stamps of a device's own clock into times of the host's, from what both said of each
/// frame. What arrives is late, never early: of the last kWindow frames the one that was the least
/// late tells the offset, so that a busy host does not move exposures, and drift is followed.
///
/// A clock that was set begins anew: at once when it is ahead by kStep or behind by kLost, else
/// when the window has passed.
class DeviceClock {
 public:
  /// `device`, `host`: of one frame [ns]. Returns `device` on the host's clock.
  TimeNs to_host(TimeNs device, TimeNs host);
  void reset();

  [[nodiscard]] TimeNs offset() const { return offset_; }  ///< host minus device [ns]
  [[nodiscard]] TimeNs late() const { return late_; }      ///< of the last frame, beyond the offset
  [[nodiscard]] std::uint64_t steps() const { return steps_; }

  static constexpr std::size_t kWindow = 64;
  static constexpr TimeNs kStep = kNsPerSecond / 5, kLost = 2 * kNsPerSecond;

 private:
  std::deque<TimeNs> seen_;
  TimeNs offset_ = 0, late_ = 0;
  std::uint64_t steps_ = 0;
};

}  // namespace crane
