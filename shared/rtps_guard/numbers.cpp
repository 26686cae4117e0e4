#include "rtps_guard/numbers.hpp"

#include <algorithm>

namespace crane::guard {
namespace {

/// More gaps than these are open nowhere: what comes then is not remembered as received, so that
/// less is believed to be there than is.
constexpr std::size_t kMostRanges = 512;

}  // namespace

void NumberBudget::fill(Clock::time_point now) {
  if (filled_ != Clock::time_point{}) {
    const double passed_s = std::chrono::duration<double>(now - filled_).count();
    left_ = std::min(double(kAtOnce), left_ + passed_s * kPerSecond);
    holdable_ = std::min(double(kHeld), holdable_ + passed_s * kHeldPerSecond);
  }
  filled_ = now;
}

std::uint64_t NumberBudget::take(std::uint64_t wanted, Clock::time_point now) {
  fill(now);
  const auto given = std::min(wanted, static_cast<std::uint64_t>(left_));
  left_ -= double(given);
  return given;
}

bool NumberBudget::hold(std::uint64_t wanted, Clock::time_point now) {
  fill(now);
  if (held + wanted > kHeld || double(wanted) > holdable_) return false;
  holdable_ -= double(wanted);
  return true;
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
