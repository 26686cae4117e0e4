// SPDX-License-Identifier: Apache-2.0
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

bool Participant::has_announced(std::uint32_t entity) const {
  const auto writer = writers.find(entity);
  return readers.contains(entity) || (writer != writers.end() && writer->second.announced);
}

void Participant::forget_endpoint(std::uint32_t entity) {
  readers.erase(entity);
  if (const auto writer = writers.find(entity); writer != writers.end())
    writer->second.announced = false;
}

void Participant::forget_endpoints() {
  readers.clear();
  for (auto& [entity, writer] : writers) writer.announced = false;
}

void Participant::lapse() {
  if (!lapsed) settled = heard - since >= kSettledAfter;
  lapsed = true;
}

bool Newcomers::admit(const Origin& origin, Clock::time_point now) {
  if (origin.this_host) return this_host_.take(now);
  auto known = addresses_.find(origin.address);
  if (known == addresses_.end()) {
    if (addresses_.size() >= kAddresses)
      std::erase_if(addresses_, [&](const auto& a) { return a.second.is_full(now); });
    if (addresses_.size() >= kAddresses) return elsewhere_.take(now);
    known =
        addresses_.emplace(origin.address, Allowance(kOfOneAddressAtOnce, kOfOneAddressPerSecond))
            .first;
  }
  return known->second.left(now) >= 1 && elsewhere_.take(now) && known->second.take(now);
}

Participant* Participants::find(const Prefix& prefix, Clock::time_point now) {
  const auto known = all_.find(prefix);
  if (known == all_.end()) return nullptr;
  if (now - known->second.heard <= kRemembered) return &known->second;
  release(known->second);
  all_.erase(known);
  return nullptr;
}

Participant* Participants::announce(const Prefix& prefix, const Origin& origin,
                                    Clock::time_point now) {
  if (Participant* known = find(prefix, now)) {
    if (known->lapsed) {
      if (!(known->settled ? returning_ : newcomers_).admit(origin, now)) return nullptr;
      known->forget_endpoints();
      known->lapsed = false;
    }
    known->heard = now;
    return known;
  }
  if (all_.size() >= kMost)
    std::erase_if(all_, [&](const auto& p) {
      const bool gone = now - p.second.heard > kRemembered;
      if (gone) release(p.second);
      return gone;
    });
  if (all_.size() >= kMost || !newcomers_.admit(origin, now)) return nullptr;
  Participant& fresh = all_[prefix];
  fresh.since = fresh.heard = now;
  return &fresh;
}

bool Participants::admit_endpoint(Participant& of, bool known, Clock::time_point now) {
  if (!known && of.readers.size() + of.writers.size() >= Participant::kEndpoints) return false;
  Allowance& of_all = of.settled ? returning_endpoints_ : endpoints_;
  return of.endpoints.left(now) >= 1 && of_all.take(now) && of.endpoints.take(now);
}

}  // namespace crane::guard
