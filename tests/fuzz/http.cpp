// SPDX-License-Identifier: Apache-2.0
// HTTP requests of any bytes: each gets an answer of the table, and none but an own name passes for
// one of ours.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "http/host_check.hpp"
#include "http/router.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crane::http;
  static const Router kRouter({{"/metrics", [] { return Response{200, "x 1\n"}; }}}, {"mapper"});
  // Method, target and Host lines, a line each.
  std::array<std::string, 4> lines;
  std::size_t n = 0;
  for (std::size_t i = 0; i < size && n < lines.size(); ++i)
    if (data[i] == '\n')
      ++n;
    else
      lines[n].push_back(static_cast<char>(data[i]));
  Request request{lines[0], lines[1], {}, "10.1.2.3"};
  for (std::size_t i = 2; i < lines.size(); ++i)
    if (!lines[i].empty()) request.hosts.push_back(lines[i]);
  const Response answer = kRouter.answer(request);
  const bool known = answer.status == 200 || answer.status == 400 || answer.status == 403 ||
                     answer.status == 404 || answer.status == 405;
  if (!known || answer.body.empty()) std::abort();
  for (const std::string& host : request.hosts) {
    if (!is_own_host(host, request.local_address, {"mapper"})) continue;
    if (host.find('.') == std::string::npos || host.find_first_of("ghjk") == std::string::npos)
      continue;
    // A name with dots: localhost with its last one, nothing that could be registered.
    std::string lower = host.substr(0, host.find(':'));
    std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) {
      return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
    });
    if (lower != "localhost." && lower != "mapper.") std::abort();
  }
  return 0;
}
