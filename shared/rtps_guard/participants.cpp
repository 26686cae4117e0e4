#include "rtps_guard/participants.hpp"

#include <algorithm>

namespace crane::guard {
namespace {

constexpr auto kRemembered = std::chrono::seconds(61);  // the longest lease

}  // namespace

bool Participant::lives_at(const Origin& origin) const {
  if (origin.address == 0) return true;
  if (this_host && origin.this_host) return true;
  return std::find(addresses.begin(), addresses.end(), origin.address) != addresses.end();
}

std::uint64_t Participant::held() const {
  std::uint64_t sum = 0;
  for (const auto& [pair, track] : numbers) sum += track.held();
  return sum;
}

void Participants::forget(const Prefix& prefix) {
  const auto known = all_.find(prefix);
  if (known == all_.end()) return;
  release(known->second);
  all_.erase(known);
}

Participant* Participants::find(const Prefix& prefix, Clock::time_point now) {
  const auto known = all_.find(prefix);
  if (known == all_.end()) return nullptr;
  if (now - known->second.heard <= kRemembered) return &known->second;
  forget(prefix);
  return nullptr;
}

Participant* Participants::announce(const Prefix& prefix, Clock::time_point now) {
  if (Participant* known = find(prefix, now)) {
    known->heard = now;
    return known;
  }
  if (filled_ != Clock::time_point{})
    newcomers_ = std::min(
        kNewcomersAtOnce,
        newcomers_ + std::chrono::duration<double>(now - filled_).count() * kNewcomersPerSecond);
  filled_ = now;
  if (newcomers_ < 1) return nullptr;
  if (all_.size() >= kMost)
    std::erase_if(all_, [&](const auto& p) {
      const bool gone = now - p.second.heard > kRemembered;
      if (gone) release(p.second);
      return gone;
    });
  if (all_.size() >= kMost) return nullptr;
  newcomers_ -= 1;
  Participant& fresh = all_[prefix];
  fresh.heard = now;
  return &fresh;
}

}  // namespace crane::guard
