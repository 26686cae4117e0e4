// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace crane::http {

/// A request as it stands in the message; nothing of it is believed yet.
struct Request {
  std::string method;
  std::string target;              ///< "/metrics?name=x"
  std::vector<std::string> hosts;  ///< Host lines, in a sound message at most one
  std::string local_address;       ///< of ours, that it came in at
};

struct Response {
  int status = 200;
  std::string body;
  std::string type = "text/plain; charset=utf-8";
};

}  // namespace crane::http
