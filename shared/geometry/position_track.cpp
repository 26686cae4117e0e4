// SPDX-License-Identifier: Apache-2.0
#include "geometry/position_track.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

/// What jumps away and comes back within this is the run that it was. Later the axis could be
/// anywhere, and another wrong reading would pass for the old place.
constexpr TimeNs kComesBack = kNsPerSecond / 2;
/// A device that hangs repeats its last reading. One that works repeats it while the axis stands
/// still, but no axis stops from this speed between two readings.
constexpr double kMoving_mps = 0.3;
constexpr TimeNs kMovingFor = 3 * kNsPerSecond / 10;
constexpr std::ptrdiff_t kRepeats = 6;

}  // namespace

bool PositionTrack::reaches(const Reading& from, TimeNs time, double distance_m) const {
  const double passed_s = std::abs(double(time - from.time)) * 1e-9;
  return std::abs(distance_m - from.distance_m) <=
         limits_.largest_speed_mps * passed_s + limits_.noise_m;
}

std::uint32_t PositionTrack::run_of(Iterator after, TimeNs time, double distance_m) {
  if (readings_.empty()) return trusted_run_;
  if (after != readings_.begin() && reaches(*std::prev(after), time, distance_m))
    return std::prev(after)->run;
  if (after != readings_.end()) {
    if (reaches(*after, time, distance_m)) return after->run;
  } else {
    const auto last_trusted =
        std::find_if(readings_.rbegin(), readings_.rend(), [this, time](const Reading& r) {
          return (used_ && r.run == trusted_run_) || time - r.time > kComesBack;
        });
    if (last_trusted != readings_.rend() && time - last_trusted->time <= kComesBack &&
        reaches(*last_trusted, time, distance_m))
      return trusted_run_;
    last_jump_m_ = distance_m - readings_.back().distance_m;
  }
  return ++newest_run_;
}

bool PositionTrack::stuck(double distance_m) const {
  std::ptrdiff_t repeats = 0;
  auto r = readings_.rbegin();
  for (; r != readings_.rend() && r->distance_m == distance_m; ++r) ++repeats;
  // The first of those that are the same was still measured.
  if (repeats < kRepeats) return false;
  const Reading& stopped = *std::prev(r);
  const Reading* earliest = nullptr;
  for (; r != readings_.rend() && r->run == stopped.run && stopped.time - r->time <= kMovingFor;
       ++r)
    earliest = &*r;
  if (earliest == nullptr) return false;
  const double passed_s = double(stopped.time - earliest->time) * 1e-9;
  return std::abs(stopped.distance_m - earliest->distance_m) > kMoving_mps * passed_s;
}

void PositionTrack::doubt(TimeNs time) {
  const auto at = std::lower_bound(doubts_.begin(), doubts_.end(), time);
  if (at != doubts_.end() && *at == time) return;
  doubts_.insert(at, time);
  if (doubts_.size() > capacity_) doubts_.pop_front();
}

bool PositionTrack::doubtful(TimeNs from, TimeNs to) const {
  const auto first = std::lower_bound(doubts_.begin(), doubts_.end(), from);
  return first != doubts_.end() && *first <= to;
}

PositionTrack::Added PositionTrack::add(TimeNs time, double distance_m) {
  const bool finite = std::isfinite(distance_m);
  if (!finite || distance_m < limits_.min_m || distance_m > limits_.max_m) {
    doubt(time);
    return finite ? Added::kOutOfRange : Added::kNotFinite;
  }
  const auto after = not_before(time);
  const bool newest = after == readings_.end();
  if (!newest) {
    const bool first = after == readings_.begin();
    const bool in_gap = first || after->time - std::prev(after)->time > limits_.max_gap.count();
    if (after->time == time || !in_gap || (first && readings_.size() == capacity_))
      return Added::kOutOfOrder;
  }
  const bool hangs = newest && stuck(distance_m);
  const std::uint32_t known_runs = newest_run_;
  const std::uint32_t run = run_of(after, time, distance_m);
  readings_.insert(after, {time, distance_m, run});
  if (readings_.size() > capacity_) readings_.pop_front();
  if (hangs) {
    doubt(time);
    return Added::kStuck;
  }
  return newest_run_ > known_runs ? Added::kJump : Added::kYes;
}

PositionTrack::Lookup PositionTrack::at(TimeNs time, double& distance_m) const {
  const auto after = not_before(time);
  // What waits for the next reading need not, when that was refused.
  if (after == readings_.end())
    return !doubts_.empty() && doubts_.back() >= time ? Lookup::kDoubtful : Lookup::kNotYet;
  const bool first = after == readings_.begin();
  const auto before = first ? after : std::prev(after);
  const bool exact = after->time == time;
  const TimeNs gap = limits_.max_gap.count();
  if (!exact && (first || after->time - before->time > gap))
    return doubtful(std::max(before->time, time - gap), after->time) && !first ? Lookup::kDoubtful
                                                                               : Lookup::kGap;
  // A reading by itself, with another run on both sides, is a jump there and back.
  const bool joined =
      exact ? (!first && before->run == after->run) ||
                  (std::next(after) != readings_.end() && std::next(after)->run == after->run) ||
                  readings_.size() == 1
            : before->run == after->run;
  if (!joined && exact && std::next(after) == readings_.end()) return Lookup::kNotYet;
  if (!joined || doubtful(exact ? time : before->time, after->time)) return Lookup::kDoubtful;
  const double share = exact ? 1 : double(time - before->time) / double(after->time - before->time);
  distance_m = exact ? after->distance_m
                     : before->distance_m + share * (after->distance_m - before->distance_m);
  return trusts(after->run) ? Lookup::kFound : Lookup::kUnconfirmed;
}

void PositionTrack::trust(TimeNs time) {
  const auto after = not_before(time);
  if (after == readings_.end()) return;
  trusted_run_ = after->run;
  used_ = true;
}

PositionTrack::Iterator PositionTrack::not_before(TimeNs time) const {
  return std::lower_bound(readings_.begin(), readings_.end(), time,
                          [](const Reading& reading, TimeNs t) { return reading.time < t; });
}

}  // namespace crane
