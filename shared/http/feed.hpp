// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "http/message.hpp"

namespace crane::http {

struct Message {
  std::string bytes;
  bool binary = false;
};

/// What one WebSocket client is told. It is asked for the next message whenever the last one has
/// left: nothing queues, and a slow client gets what is newest then. One thread at a time.
class Feed {
 public:
  virtual ~Feed() = default;
  Feed() = default;
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  /// Nothing: it is asked again after Server::wake().
  virtual std::optional<Message> next() = 0;
  /// The client said something. False: that is no part of the protocol, and it is cut off.
  virtual bool hear(std::string_view /*said*/) { return false; }
};

using FeedMaker = std::function<std::unique_ptr<Feed>(const Request&)>;

}  // namespace crane::http
