// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "gateway/foxglove_channels.hpp"
#include "http/feed.hpp"

namespace crane::gateway {

/// The protocol's names, the best first; their messages are the same.
std::vector<std::string> foxglove_protocols();

/// One viewer that speaks Foxglove's protocol: what there is, then what it subscribed to, each
/// channel in turn, so that a large one keeps no other waiting. It may subscribe, and nothing else
/// is offered: asked for more, it is told so. Cut off is who says what is no message of the
/// protocol, or more than 10 a second for long.
class FoxgloveFeed final : public http::Feed {
 public:
  static constexpr std::size_t kMostSubscriptions = 32;

  /// `name`: of this server, for people. `now`: monotonic [ns].
  FoxgloveFeed(FoxgloveChannels& channels, std::string name, std::function<TimeNs()> now);
  ~FoxgloveFeed() override;
  FoxgloveFeed(const FoxgloveFeed&) = delete;
  FoxgloveFeed& operator=(const FoxgloveFeed&) = delete;

  std::optional<http::Message> next() override;
  bool hear(std::string_view said) override;

  [[nodiscard]] std::size_t subscriptions() const { return subscriptions_.size(); }

 private:
  struct Subscription {
    Channel channel{};
    std::uint64_t said = 0;  ///< number of the last message
  };
  bool in_time();
  void subscribe(std::uint64_t id, std::uint64_t channel);
  void unsubscribe(std::uint64_t id);
  void complain(const std::string& what);

  FoxgloveChannels& channels_;
  std::string name_;
  std::function<TimeNs()> now_;
  std::map<std::uint32_t, Subscription> subscriptions_;
  std::uint32_t last_served_ = 0;
  int greeted_ = 0;
  std::vector<std::string> complaints_;
  double may_say_;  ///< so many messages at once
  TimeNs refilled_;
};

}  // namespace crane::gateway
