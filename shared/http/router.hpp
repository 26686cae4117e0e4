// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "http/feed.hpp"
#include "http/message.hpp"

namespace crane::http {

/// Called on a thread of the server.
using Handler = std::function<Response()>;
using AskedHandler = std::function<Response(const Request&)>;
/// Says why a request is not answered, or nothing.
using Guard = std::function<std::optional<Response>(const Request&)>;

/// From a request to its answer: who may ask, what there is. Values in, values out.
class Router {
 public:
  /// `routes`: by path. `hosts`: names of this machine, beside those that it knows of itself.
  Router(std::map<std::string, Handler> routes, std::vector<std::string> hosts);

  /// Further paths, of a GET (and HEAD) that is looked at, and of a POST with JSON as its body.
  void get(const std::string& path, AskedHandler handler) { gets_[path] = std::move(handler); }
  void post(const std::string& path, AskedHandler handler) { posts_[path] = std::move(handler); }
  /// A WebSocket. `protocols`: sub-protocols that it speaks, the best first; who offers none of
  /// them is refused, unless there are none. `origins`: pages of others that may use it.
  void stream(const std::string& path, FeedMaker maker, std::vector<std::string> protocols = {},
              std::vector<std::string> origins = {}) {
    streams_[path] = {std::move(maker), std::move(protocols), std::move(origins)};
  }
  /// Asked before any path is looked at, once Host and Origin are known to be ours.
  void guard(Guard guard) { guard_ = std::move(guard); }
  /// Lines that every answer has.
  void headers(std::vector<std::pair<std::string, std::string>> lines) {
    headers_ = std::move(lines);
  }

  /// 400 unsound, 403 a Host or Origin that is not ours, 404, 405, 415; else what the handler says,
  /// 500 if it throws. A request without a Host line is answered: browsers, whom the check is for,
  /// always send one. Any thread, if the handlers are.
  [[nodiscard]] Response answer(const Request& request) const;

  /// Of a request for a WebSocket: its feed, or why there is none.
  struct Upgrade {
    std::unique_ptr<Feed> feed;
    Response refused;
    std::string protocol{};  ///< that is spoken; empty: none was asked for
  };
  [[nodiscard]] Upgrade upgrade(const Request& request) const;

 private:
  struct StreamRoute {
    FeedMaker maker;
    std::vector<std::string> protocols, origins;
  };
  [[nodiscard]] std::optional<Response> refuse(const Request& request,
                                               const std::vector<std::string>& origins) const;
  [[nodiscard]] Response routed(const Request& request) const;

  std::map<std::string, AskedHandler> gets_, posts_;
  std::map<std::string, StreamRoute> streams_;
  Guard guard_;
  std::vector<std::string> hosts_;
  std::vector<std::pair<std::string, std::string>> headers_;
};

}  // namespace crane::http
