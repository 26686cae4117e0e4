// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "base/clock.hpp"

namespace crane {

/// What a rangefinder and the axis it measures can do.
struct PositionLimits {
  double min_m = 0.05, max_m = 1000;              ///< readings outside are refused
  std::chrono::nanoseconds max_gap{200'000'000};  ///< between two readings that are interpolated
  double largest_speed_mps = 3;                   ///< of the axis
  double noise_m = 0.03;                          ///< what two readings of one place may differ by
};

/// What one rangefinder said over the last while: interpolation to any time in between, as far as
/// what it said can be true.
///
/// Readings that follow each other no faster than the axis can move are one *run*. A reading that
/// jumps begins another. Positions are of the run that is trusted: that of the first that was used,
/// until a frame has shown that another one is right (trust()); what jumped away and at once came
/// back is the trusted run again. Beside a reading that was refused nothing is known.
///
/// Memory is bounded by `capacity`; the oldest readings go first. Not thread-safe.
class PositionTrack {
 public:
  enum class Added {
    kYes,
    kNotFinite,   ///< NaN or infinite
    kOutOfRange,  ///< below min or above max of the device
    kOutOfOrder,  ///< not later than the newest reading, and no gap is there to be filled
    kJump,        ///< farther from the one before than the axis moves: kept, in a run of its own
    kStuck,       ///< the same to the last digit, again and again, just after the axis moved
  };
  enum class Lookup {
    kFound,
    kNotYet,       ///< the newest reading is older than the time asked for: wait
    kGap,          ///< no pair of readings within the allowed gap
    kDoubtful,     ///< a reading beside that time was refused or jumped
    kUnconfirmed,  ///< known, but of a run that is not trusted
  };

  explicit PositionTrack(const PositionLimits& limits, std::size_t capacity = 20'000)
      : limits_(limits), capacity_(capacity) {}

  /// A reading that comes late, sent again after a loss, fills a gap; elsewhere it changes nothing.
  Added add(TimeNs time, double distance_m);

  /// Linear interpolation at `time` between two readings at most the allowed gap apart
  /// (Zhao et al. 2021, eq. 7: t1, t2). `distance_m` is written for kFound and kUnconfirmed.
  Lookup at(TimeNs time, double& distance_m) const;

  /// What was known at `time` was right: its run is the trusted one from now on.
  void trust(TimeNs time);
  /// Whether the newest reading is of the trusted run.
  [[nodiscard]] bool trusted() const { return readings_.empty() || trusts(readings_.back().run); }
  /// By how much the last run jumped away [m]; 0 = none did.
  [[nodiscard]] double last_jump_m() const { return last_jump_m_; }

  void clear() { *this = PositionTrack(limits_, capacity_); }

 private:
  struct Reading {
    TimeNs time;
    double distance_m;
    std::uint32_t run;
  };
  using Iterator = std::deque<Reading>::const_iterator;
  /// While nothing rests on any run, the first may as well be the wrong one.
  [[nodiscard]] bool trusts(std::uint32_t run) const { return !used_ || run == trusted_run_; }
  [[nodiscard]] Iterator not_before(TimeNs time) const;
  [[nodiscard]] bool reaches(const Reading& from, TimeNs time, double distance_m) const;
  /// The run a reading at `after` belongs to; a new one if none fits.
  std::uint32_t run_of(Iterator after, TimeNs time, double distance_m);
  [[nodiscard]] bool stuck(double distance_m) const;
  void doubt(TimeNs time);
  [[nodiscard]] bool doubtful(TimeNs from, TimeNs to) const;

  PositionLimits limits_;
  std::size_t capacity_;
  std::deque<Reading> readings_;
  std::deque<TimeNs> doubts_;  ///< of readings that were refused, in order
  std::uint32_t newest_run_ = 0, trusted_run_ = 0;
  bool used_ = false;  ///< something rests on the trusted run
  double last_jump_m_ = 0;
};

}  // namespace crane
