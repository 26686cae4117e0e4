// SPDX-License-Identifier: Apache-2.0
#include "gateway/foxglove_channels.hpp"

#include <utility>

#include "base/expects.hpp"

namespace crane::gateway {
namespace {

constexpr std::size_t kMostKept = 64;

bool keeps_more(Channel channel) {
  return channel == Channel::kTransforms || channel == Channel::kLog;
}

}  // namespace

void FoxgloveChannels::put(Channel channel, TimeNs time, std::string payload) {
  auto shared = std::make_shared<const std::string>(std::move(payload));
  const std::lock_guard lock(mutex_);
  State& s = states_[std::size_t(channel)];
  if (!s.kept.empty() && (!keeps_more(channel) || s.kept.size() == kMostKept)) s.kept.pop_front();
  s.kept.push_back({++s.last, time, std::move(shared)});
}

std::optional<FoxgloveChannels::Said> FoxgloveChannels::after(Channel channel,
                                                              std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  for (const Said& said : states_[std::size_t(channel)].kept)
    if (said.number > number) return said;
  return std::nullopt;
}

void FoxgloveChannels::want(Channel channel, int change) {
  const std::lock_guard lock(mutex_);
  State& s = states_[std::size_t(channel)];
  s.wanted += change;
  expects(s.wanted >= 0, "who wants no more has wanted");
  if (s.wanted == 0 && !keeps_more(channel)) s.kept.clear();
}

bool FoxgloveChannels::wanted(Channel channel) const {
  const std::lock_guard lock(mutex_);
  return states_[std::size_t(channel)].wanted > 0;
}

}  // namespace crane::gateway
