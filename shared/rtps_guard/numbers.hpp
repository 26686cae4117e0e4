// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "rtps_guard/allowance.hpp"

namespace crane::guard {

/// How many sequence numbers may be walked: so many at once, and so many a second again. Fast DDS
/// goes through what a heartbeat or gap declares lost one by one, with the reader's lock held: 0.12
/// and 0.24 us each (2 Xeon cores, 2.9.1), so at most 2 s in one go and half of the time after
/// that.
class NumberBudget {
 public:
  static constexpr std::uint64_t kAtOnce = 1U << 24U, kPerSecond = 1U << 22U;
  static constexpr std::uint64_t kGapCosts = 2;
  static constexpr std::uint64_t kHeld = 1U << 20U;  ///< 64 bytes each in Fast DDS
  static constexpr std::uint64_t kHeldPerSecond = 1U << 14U;
  static constexpr std::uint64_t kHeldOfOne = 1024;  ///< that each participant may have beyond that
  static constexpr std::uint64_t kLongestGap = 1U << 22U;  ///< that is walked from number 1 on

  /// As many of `wanted` as may be walked now.
  std::uint64_t take(std::uint64_t wanted, Clock::time_point now);

  /// Whether so many may be declared void one by one, which Fast DDS may have to keep.
  bool hold(std::uint64_t wanted, Clock::time_point now);

  std::uint64_t held = 0;  ///< by all writers

 private:
  Allowance walked_{double(kAtOnce), double(kPerSecond)};
  Allowance holdable_{double(kHeld), double(kHeldPerSecond)};
};

/// What a reliable reader of Fast DDS has of one writer's numbers (rtps/reader/WriterProxy.cpp):
/// all up to low(), and ranges above, each number of which it keeps in a set.
class NumberTrack {
 public:
  [[nodiscard]] std::uint64_t low() const { return low_; }
  [[nodiscard]] std::uint64_t held() const { return held_; }
  /// A heartbeat that is not older than the last; count as in the submessage.
  bool is_new_heartbeat(std::uint32_t count);
  /// All below are gone.
  void begin_at(std::uint64_t first);
  /// As if nothing had come: Fast DDS knows the writer no more.
  void forget() { *this = NumberTrack(); }
  [[nodiscard]] bool has(std::uint64_t number) const;
  /// Whether one may be apart from the rest: more gaps than some thousands are open nowhere.
  [[nodiscard]] bool has_room() const;
  /// These have come, or never will: [from, to).
  void add(std::uint64_t from, std::uint64_t to);

 private:
  struct Range {
    std::uint64_t from, to;
  };
  void settle();

  std::uint64_t low_ = 0, held_ = 0;
  std::uint32_t heartbeats_ = 0;
  std::vector<Range> above_;  ///< ascending, apart from each other; few
};

}  // namespace crane::guard
