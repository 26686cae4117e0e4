// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/numbers.hpp"

#include <algorithm>

namespace crane::guard {
namespace {

constexpr std::size_t kMostRanges = 2048;

}  // namespace

std::uint64_t NumberBudget::take(std::uint64_t wanted, Clock::time_point now) {
  const auto given = std::min(wanted, static_cast<std::uint64_t>(walked_.left(now)));
  walked_.take(now, double(given));
  return given;
}

bool NumberBudget::hold(std::uint64_t wanted, Clock::time_point now) {
  return held + wanted <= kHeld && holdable_.take(now, double(wanted));
}

bool NumberTrack::has(std::uint64_t number) const {
  return number <= low_ || std::any_of(above_.begin(), above_.end(), [number](const Range& r) {
           return r.from <= number && number < r.to;
         });
}

bool NumberTrack::has_room() const {
  return above_.size() < kMostRanges;
}

bool NumberTrack::is_new_heartbeat(std::uint32_t count) {
  if (count <= heartbeats_) return false;
  heartbeats_ = count;
  return true;
}

void NumberTrack::begin_at(std::uint64_t first) {
  if (first == 0 || first - 1 <= low_) return;
  low_ = first - 1;
  settle();
}

void NumberTrack::add(std::uint64_t from, std::uint64_t to) {
  from = std::max(from, low_ + 1);
  if (from >= to) return;
  if (from == low_ + 1) {
    low_ = to - 1;
    settle();
    return;
  }
  auto at =
      std::find_if(above_.begin(), above_.end(), [&](const Range& r) { return r.to >= from; });
  if (at == above_.end() || at->from > to) {
    if (above_.size() < kMostRanges) above_.insert(at, {from, to});
  } else {
    at->from = std::min(at->from, from);
    at->to = std::max(at->to, to);
    for (auto after = at + 1; after != above_.end() && after->from <= at->to;
         after = above_.erase(after))
      at->to = std::max(at->to, after->to);
  }
  settle();
}

void NumberTrack::settle() {
  while (!above_.empty() && above_.front().from <= low_ + 1) {
    low_ = std::max(low_, above_.front().to - 1);
    above_.erase(above_.begin());
  }
  held_ = 0;
  for (const Range& r : above_) held_ += r.to - r.from;
}

}  // namespace crane::guard
