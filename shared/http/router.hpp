// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "http/message.hpp"

namespace crane::http {

/// Called on the server's thread, so it waits for nothing.
using Handler = std::function<Response()>;

/// From a request to its answer: who may ask, what there is. Values in, values out.
class Router {
 public:
  /// `routes`: by path. `hosts`: names of this machine, beside those that it knows of itself.
  Router(std::map<std::string, Handler> routes, std::vector<std::string> hosts);

  /// 400 unsound, 403 a Host that is not ours, 404, 405; else what the handler says, 500 if it
  /// throws. A request without a Host line is answered: browsers, whom the check is for, always
  /// send one.
  [[nodiscard]] Response answer(const Request& request) const;

 private:
  std::map<std::string, Handler> routes_;
  std::vector<std::string> hosts_;
};

}  // namespace crane::http
