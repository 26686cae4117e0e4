// SPDX-License-Identifier: Apache-2.0
#include "http/router.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "http/host_check.hpp"

namespace crane::http {

Router::Router(std::map<std::string, Handler> routes, std::vector<std::string> hosts)
    : hosts_(std::move(hosts)) {
  for (auto& [path, handler] : routes)
    gets_[path] = [plain = std::move(handler)](const Request&) { return plain(); };
  if (std::string own = host_name(); !own.empty()) hosts_.push_back(std::move(own));
}

std::optional<Response> Router::refuse(const Request& request,
                                       const std::vector<std::string>& origins) const {
  if (request.hosts.size() > 1) return Response{400, "more than one Host line\n"};
  if (!request.hosts.empty() && !is_own_host(request.hosts[0], request.local_address, hosts_))
    return Response{403, "this host is not known by that name: list it in http.hosts\n"};
  // A page of somebody else may ask us, but not in a way that does something; of a WebSocket it
  // could even read the answer.
  if (!request.origin.empty() &&
      (request.hosts.empty() || !is_same_origin(request.origin, request.hosts[0])) &&
      std::find(origins.begin(), origins.end(), request.origin) == origins.end())
    return Response{403, "asked by a page of another origin\n"};
  if (!request.target.starts_with('/')) return Response{400, "the target must be a path\n"};
  return guard_ ? guard_(request) : std::nullopt;
}

Response Router::routed(const Request& request) const {
  const std::string path = request.path();
  const auto get = gets_.find(path);
  const auto post = posts_.find(path);
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if (reads && get != gets_.end()) return get->second(request);
  if (request.method == "POST" && post != posts_.end()) {
    if (!request.content_type.starts_with("application/json"))
      return {415, "the body must be application/json\n"};
    return post->second(request);
  }
  if (streams_.contains(path)) return {426, "this is a WebSocket\n"};
  if (get == gets_.end() && post == posts_.end() && reads) return {404, "nothing of this name\n"};
  return {405, post == posts_.end() ? "only GET and HEAD\n" : "only POST\n"};
}

Response Router::answer(const Request& request) const {
  Response response;
  try {
    const auto refused = refuse(request, {});
    response = refused ? *refused : routed(request);
  } catch (const std::exception&) {  // out of memory: the next one may have it
    response = {500, "no answer could be made\n"};
  }
  response.headers.insert(response.headers.end(), headers_.begin(), headers_.end());
  return response;
}

Router::Upgrade Router::upgrade(const Request& request) const {
  try {
    const auto found = streams_.find(request.path());
    const StreamRoute* route = found == streams_.end() ? nullptr : &found->second;
    if (auto refused =
            refuse(request, route == nullptr ? std::vector<std::string>{} : route->origins))
      return {nullptr, *refused};
    if (route == nullptr) return {nullptr, {404, "no WebSocket of this name\n"}};
    const auto& own = route->protocols;
    const auto spoken = std::find_if(own.begin(), own.end(), [&](const std::string& protocol) {
      return std::find(request.protocols.begin(), request.protocols.end(), protocol) !=
             request.protocols.end();
    });
    if (own.empty()) return {route->maker(request), {503, "no room for one more\n"}};
    if (spoken == own.end())
      return {nullptr, {400, "offer one of the sub-protocols spoken here, as " + own[0] + "\n"}};
    return {route->maker(request), {503, "no room for one more\n"}, *spoken};
  } catch (const std::exception&) {
    return {nullptr, {500, "no answer could be made\n"}};
  }
}

}  // namespace crane::http
