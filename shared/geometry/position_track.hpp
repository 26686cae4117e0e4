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
    kOutOfOrder,  ///< not later than the newest reading, and no gap is there to be filled
  };
  enum class Lookup {
    kFound,
    kNotYet,  ///< the newest reading is older than the time asked for: wait
    kGap,     ///< no pair of readings within the allowed gap
  };

  /// Readings outside [min_m, max_m] are refused; between two more than `max_gap` apart the
  /// position is not known.
  PositionTrack(double min_m, double max_m, std::chrono::nanoseconds max_gap,
                std::size_t capacity = 20'000)
      : min_m_(min_m), max_m_(max_m), max_gap_(max_gap.count()), capacity_(capacity) {}

  /// A reading that comes late, sent again after a loss, fills a gap; elsewhere it changes nothing.
  Added add(TimeNs time, double distance_m);

  /// Linear interpolation at `time` between two readings at most the allowed gap apart
  /// (Zhao et al. 2021, eq. 7: t1, t2). `distance_m` is written only for kFound.
  Lookup at(TimeNs time, double& distance_m) const;

  void clear() { readings_.clear(); }

 private:
  struct Reading {
    TimeNs time;
    double distance_m;
  };
  [[nodiscard]] std::deque<Reading>::const_iterator not_before(TimeNs time) const;

  double min_m_, max_m_;
  TimeNs max_gap_;
  std::size_t capacity_;
  std::deque<Reading> readings_;
};

}  // namespace crane
