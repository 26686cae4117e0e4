// SPDX-License-Identifier: Apache-2.0
#include "http/router.hpp"

#include <exception>
#include <utility>

#include "http/host_check.hpp"

namespace crane::http {

Router::Router(std::map<std::string, Handler> routes, std::vector<std::string> hosts)
    : routes_(std::move(routes)), hosts_(std::move(hosts)) {
  if (std::string own = host_name(); !own.empty()) hosts_.push_back(std::move(own));
}

Response Router::answer(const Request& request) const {
  if (request.hosts.size() > 1) return {400, "more than one Host line\n"};
  if (!request.hosts.empty() && !is_own_host(request.hosts[0], request.local_address, hosts_))
    return {403, "this host is not known by that name: list it in http.hosts\n"};
  if (request.method != "GET" && request.method != "HEAD") return {405, "only GET and HEAD\n"};
  if (!request.target.starts_with('/')) return {400, "the target must be a path\n"};
  const auto route = routes_.find(request.target.substr(0, request.target.find('?')));
  if (route == routes_.end()) return {404, "nothing of this name\n"};
  try {
    return route->second();
  } catch (const std::exception&) {  // out of memory: the next one may have it
    return {500, "no answer could be made\n"};
  }
}

}  // namespace crane::http
