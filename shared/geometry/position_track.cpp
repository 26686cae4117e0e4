#include "geometry/position_track.hpp"

#include <algorithm>
#include <cmath>

namespace crane {

PositionTrack::Added PositionTrack::add(TimeNs time, double distance_m) {
  if (!std::isfinite(distance_m)) return Added::kNotFinite;
  if (distance_m < min_m_ || distance_m > max_m_) return Added::kOutOfRange;
  if (!readings_.empty() && time <= readings_.back().time) return Added::kOutOfOrder;
  readings_.push_back({time, distance_m});
  if (readings_.size() > capacity_) readings_.pop_front();
  return Added::kYes;
}

PositionTrack::Lookup PositionTrack::at(TimeNs time, std::chrono::nanoseconds max_gap,
                                        double& distance_m) const {
  if (readings_.empty() || readings_.back().time < time) return Lookup::kNotYet;
  const auto after =
      std::lower_bound(readings_.begin(), readings_.end(), time,
                       [](const Reading& reading, TimeNs t) { return reading.time < t; });
  if (after->time == time) {
    distance_m = after->distance_m;
    return Lookup::kFound;
  }
  if (after == readings_.begin()) return Lookup::kGap;
  const Reading& before = *std::prev(after);
  if (after->time - before.time > max_gap.count()) return Lookup::kGap;
  const double share = double(time - before.time) / double(after->time - before.time);
  distance_m = before.distance_m + share * (after->distance_m - before.distance_m);
  return Lookup::kFound;
}

}  // namespace crane
