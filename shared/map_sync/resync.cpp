// SPDX-License-Identifier: Apache-2.0
#include "map_sync/resync.hpp"

#include <algorithm>

namespace crane {

Resync::Ask Resync::due(Clock::time_point now, Clock::time_point heard_at) {
  using namespace std::chrono_literals;
  constexpr int kMostDoublings = 5;  // 22 s
  // Two times all of it at the full pace; what does not help by then helps no sooner.
  const int doublings = std::clamp(in_vain_ - 2 * kUntilAnew, 0, kMostDoublings);
  if (now < rest_until_ || now - heard_at > 1s || now - moved_at_ < kAfter ||
      now - asked_at_ < kAfter * (1 << doublings))
    return Ask::kNot;
  asked_at_ = now;
  ++in_vain_;
  return in_vain_ % (kUntilAnew + 1) == 0 ? Ask::kForAll : Ask::kForWhatLacks;
}

}  // namespace crane
