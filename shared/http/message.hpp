// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace crane::http {

/// A request as it stands in the message; nothing of it is believed yet.
struct Request {
  std::string method;
  std::string target;              ///< "/metrics?name=x"
  std::vector<std::string> hosts;  ///< Host lines, in a sound message at most one
  std::string local_address;       ///< of ours, that it came in at
  /// Other lines of it, empty where there is none.
  std::string origin{}, authorization{}, cookie{}, content_type{};
  std::string body{};
  bool upgrade = false;                  ///< asks for a WebSocket
  bool secure = false;                   ///< came by TLS
  std::vector<std::string> protocols{};  ///< of a WebSocket, that the client offers, best first

  [[nodiscard]] std::string path() const { return target.substr(0, target.find('?')); }
  /// What follows the first '?'.
  [[nodiscard]] std::string query() const {
    const std::size_t mark = target.find('?');
    return mark == std::string::npos ? "" : target.substr(mark + 1);
  }
};

struct Response {
  int status = 200;
  std::string body;
  std::string type = "text/plain; charset=utf-8";
  std::vector<std::pair<std::string, std::string>> headers{};  ///< further ones
};

}  // namespace crane::http
