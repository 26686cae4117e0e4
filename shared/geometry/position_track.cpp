#include "geometry/position_track.hpp"

#include <algorithm>
#include <cmath>

namespace crane {

PositionTrack::Added PositionTrack::add(TimeNs time, double distance_m) {
  if (!std::isfinite(distance_m)) return Added::kNotFinite;
  if (distance_m < min_m_ || distance_m > max_m_) return Added::kOutOfRange;
  const auto after = not_before(time);
  if (after != readings_.end()) {
    const bool first = after == readings_.begin();
    const bool in_gap = first || after->time - std::prev(after)->time > max_gap_;
    if (after->time == time || !in_gap || (first && readings_.size() == capacity_))
      return Added::kOutOfOrder;
  }
  readings_.insert(after, {time, distance_m});
  if (readings_.size() > capacity_) readings_.pop_front();
  return Added::kYes;
}

PositionTrack::Lookup PositionTrack::at(TimeNs time, double& distance_m) const {
  const auto after = not_before(time);
  if (after == readings_.end()) return Lookup::kNotYet;
  if (after->time == time) {
    distance_m = after->distance_m;
    return Lookup::kFound;
  }
  if (after == readings_.begin()) return Lookup::kGap;
  const Reading& before = *std::prev(after);
  if (after->time - before.time > max_gap_) return Lookup::kGap;
  const double share = double(time - before.time) / double(after->time - before.time);
  distance_m = before.distance_m + share * (after->distance_m - before.distance_m);
  return Lookup::kFound;
}

std::deque<PositionTrack::Reading>::const_iterator PositionTrack::not_before(TimeNs time) const {
  return std::lower_bound(readings_.begin(), readings_.end(), time,
                          [](const Reading& reading, TimeNs t) { return reading.time < t; });
}

}  // namespace crane
