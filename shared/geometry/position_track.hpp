#pragma once

#include <chrono>
#include <cstddef>
#include <deque>

#include "base/clock.hpp"

namespace crane {

/// What one rangefinder said over the last while: interpolation to any time in between.
///
/// Memory is bounded by `capacity`; the oldest readings go first. Not thread-safe.
class PositionTrack {
 public:
  enum class Added {
    kYes,
    kNotFinite,   ///< NaN or infinite
    kOutOfRange,  ///< below min or above max of the device
    kOutOfOrder,  ///< not later than the newest reading
  };
  enum class Lookup {
    kFound,
    kNotYet,  ///< the newest reading is older than the time asked for: wait
    kGap,     ///< no pair of readings within the allowed gap: never
  };

  /// Readings outside [min_m, max_m] are refused.
  PositionTrack(double min_m, double max_m, std::size_t capacity = 20'000)
      : min_m_(min_m), max_m_(max_m), capacity_(capacity) {}

  Added add(TimeNs time, double distance_m);

  /// Linear interpolation at `time` between two readings at most `max_gap` apart
  /// (Zhao et al. 2021, eq. 7: t1, t2). `distance_m` is written only for kFound.
  Lookup at(TimeNs time, std::chrono::nanoseconds max_gap, double& distance_m) const;

  void clear() { readings_.clear(); }

 private:
  struct Reading {
    TimeNs time;
    double distance_m;
  };
  double min_m_, max_m_;
  std::size_t capacity_;
  std::deque<Reading> readings_;
};

}  // namespace crane
