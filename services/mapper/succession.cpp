// SPDX-License-Identifier: Apache-2.0
#include "mapper/succession.hpp"

#include <algorithm>
#include <string>

namespace crane {

using namespace std::chrono_literals;

Result<Succession> Succession::create(const std::shared_ptr<dds::Participant>& participant,
                                      Wakeup* wakeup, std::uint64_t mapper) {
  auto others = dds::Reader<dds::MapStatusTopic>::create(participant, wakeup);
  if (!others) return others.error();
  return Succession(std::move(*others), wakeup, mapper, participant->settings().crane);
}

bool Succession::another_serves(const std::function<bool()>& stopping) {
  for (const Stopwatch watch; watch.ms() < 700 && !stopping();) {
    wakeup_->wait_for(50ms);
    // Whatever its clock says: only a writer that lives hands on its last heartbeat.
    while (const auto other = others_.take())
      if ((*other)->crane() == crane_) return true;
  }
  return false;
}

Succession::Rival Succession::look(int term, std::size_t tiles) {
  Rival rival;
  while (const auto other = others_.take()) {
    const v1::MapStatus& s = **other;
    if (s.mapper() == mapper_ || s.crane() != crane_) continue;
    const int theirs = static_cast<int>(s.term());
    if (theirs < term || (theirs == term && s.mapper() < mapper_)) continue;
    // Later than this it may know what we do not.
    constexpr TimeNs kMoments = 30 * kNsPerSecond;
    rival = {theirs, s.time_ns() - s.mapper_start_ns() < kMoments &&
                         2 * std::size_t(s.voxel_tiles()) < tiles};
  }
  return rival;
}

Error Succession::deposed_by(const Rival& rival, int term) const {
  return {ErrorCode::kResource, "map_status",
          "another mapper has taken over crane " + std::to_string(crane_) + " (term " +
              std::to_string(rival.term) + ", ours " + std::to_string(term) + ")",
          "started again with --standby, this one waits behind it"};
}

int Succession::next_term(int heard) {
  constexpr TimeNs k2020 = 1'577'836'800 * kNsPerSecond;
  return std::max(heard + 1, static_cast<int>((SystemClock().now() - k2020) / kNsPerSecond));
}

}  // namespace crane
