// SPDX-License-Identifier: Apache-2.0
#include "gateway/foxglove_feed.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "gateway/foxglove_schemas.hpp"
#include "gateway/json.hpp"

namespace crane::gateway {
namespace {

constexpr double kMostAtOnce = 100, kASecond = 10;
constexpr std::size_t kMostComplaints = 8;
constexpr char kMessageData = 1;

http::Message text_message(const Json& json) {
  return {text_of(json), false};
}

http::Message data_message(std::uint32_t subscription, const FoxgloveChannels::Said& said) {
  http::Message out;
  out.binary = true;
  char head[13] = {kMessageData};
  std::memcpy(head + 1, &subscription, 4);
  std::memcpy(head + 5, &said.time, 8);
  out.bytes.reserve(sizeof head + said.payload->size());
  out.bytes.append(head, sizeof head);
  out.bytes += *said.payload;
  return out;
}

/// The ids of a list, or nothing: something in it is none.
std::optional<std::vector<std::uint64_t>> ids_of(const Json& list) {
  if (!list.is_array()) return std::nullopt;
  std::vector<std::uint64_t> out;
  for (const Json& id : list) {
    if (!id.is_number_unsigned()) return std::nullopt;
    out.push_back(id.get<std::uint64_t>());
  }
  return out;
}

/// The member, null where there is none.
const Json& member(const Json& of, const char* name) {
  static const Json kNull;
  const auto found = of.is_object() ? of.find(name) : of.end();
  return of.is_object() && found != of.end() ? *found : kNull;
}

}  // namespace

std::vector<std::string> foxglove_protocols() {
  return {"foxglove.sdk.v1", "foxglove.websocket.v1"};
}

FoxgloveFeed::FoxgloveFeed(FoxgloveChannels& channels, std::string name,
                           std::function<TimeNs()> now)
    : channels_(channels),
      name_(std::move(name)),
      now_(std::move(now)),
      may_say_(kMostAtOnce),
      refilled_(now_()) {}

FoxgloveFeed::~FoxgloveFeed() {
  for (const auto& [id, subscription] : subscriptions_) channels_.want(subscription.channel, -1);
}

std::optional<http::Message> FoxgloveFeed::next() {
  if (greeted_ == 0) {
    ++greeted_;
    return text_message({{"op", "serverInfo"},
                         {"name", name_},
                         {"capabilities", Json::array()},
                         {"supportedEncodings", Json::array()},
                         {"metadata", {{"advice", "advisory only"}}}});
  }
  if (greeted_ == 1) {
    ++greeted_;
    return text_message(foxglove_advertisement());
  }
  if (!complaints_.empty()) {
    const std::string what = std::move(complaints_.front());
    complaints_.erase(complaints_.begin());
    return text_message({{"op", "status"}, {"level", 2}, {"message", what}});
  }
  // The next one that has something, from the one after that which had its turn.
  auto at = subscriptions_.upper_bound(last_served_);
  for (std::size_t i = 0; i < subscriptions_.size(); ++i, ++at) {
    if (at == subscriptions_.end()) at = subscriptions_.begin();
    auto& [id, subscription] = *at;
    const auto said = channels_.after(subscription.channel, subscription.said);
    if (!said) continue;
    subscription.said = said->number;
    last_served_ = id;
    return data_message(id, *said);
  }
  return std::nullopt;
}

bool FoxgloveFeed::in_time() {
  const TimeNs now = now_();
  may_say_ =
      std::min(kMostAtOnce, may_say_ + kASecond * double(now - refilled_) / double(kNsPerSecond));
  refilled_ = now;
  may_say_ -= 1;
  return may_say_ >= 0;
}

bool FoxgloveFeed::hear(std::string_view said) {
  if (!in_time()) return false;
  const Json message = Json::parse(said, nullptr, false);
  const Json& op = member(message, "op");
  if (!op.is_string()) return false;
  if (op == "subscribe") {
    const Json& list = member(message, "subscriptions");
    if (!list.is_array()) return false;
    for (const Json& one : list) {
      const Json &id = member(one, "id"), &channel = member(one, "channelId");
      if (!id.is_number_unsigned() || !channel.is_number_unsigned()) return false;
      subscribe(id.get<std::uint64_t>(), channel.get<std::uint64_t>());
    }
  } else if (op == "unsubscribe") {
    const auto ids = ids_of(member(message, "subscriptionIds"));
    if (!ids) return false;
    for (const std::uint64_t id : *ids) unsubscribe(id);
  } else {
    complain("only subscribe and unsubscribe are offered here: this server is read only");
  }
  return true;
}

void FoxgloveFeed::subscribe(std::uint64_t id, std::uint64_t channel) {
  if (id > std::numeric_limits<std::uint32_t>::max())
    return complain("a subscription's id has 32 bits");
  if (channel < 1 || channel > kChannels)
    return complain("there is no channel " + std::to_string(channel));
  if (subscriptions_.size() == kMostSubscriptions)
    return complain("no more than " + std::to_string(kMostSubscriptions) + " subscriptions");
  const auto at = static_cast<Channel>(channel - 1);
  if (!subscriptions_.try_emplace(static_cast<std::uint32_t>(id), Subscription{at}).second)
    return complain("subscription " + std::to_string(id) + " is in use");
  channels_.want(at, 1);
}

void FoxgloveFeed::unsubscribe(std::uint64_t id) {
  const auto found = id > std::numeric_limits<std::uint32_t>::max()
                         ? subscriptions_.end()
                         : subscriptions_.find(static_cast<std::uint32_t>(id));
  if (found == subscriptions_.end())
    return complain("there is no subscription " + std::to_string(id));
  channels_.want(found->second.channel, -1);
  subscriptions_.erase(found);
}

void FoxgloveFeed::complain(const std::string& what) {
  if (complaints_.size() < kMostComplaints) complaints_.push_back(what);
}

}  // namespace crane::gateway
