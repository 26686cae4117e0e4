// SPDX-License-Identifier: Apache-2.0
// What anybody may send to the gateway: query strings, bodies of questions, cookies. What passes is
// sound, whatever the bytes.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "gateway/json.hpp"
#include "gateway/token.hpp"
#include "http/query.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crane;
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (const auto query = gateway::parse_clearance(text)) {
    if (query->path.empty() || query->path.size() > 256) std::abort();
    for (const client::Pose& p : query->path)
      if (!std::isfinite(p.x_m + p.y_m + p.z_m + p.yaw_rad)) std::abort();
    if (!std::isfinite(query->load.size_x_m) || query->min_views > 32) std::abort();
  } else if (query.error().what.empty()) {
    std::abort();
  }
  if (const auto query = http::parse_query(text))
    for (const auto& [name, value] : *query) {
      if (name.empty() || value.size() > size) std::abort();
      if (const auto number = http::parse_number(value); number && !std::isfinite(*number))
        std::abort();
    }
  http::Request request{"GET", text, {}, ""};
  request.authorization = text;
  request.cookie = text;
  const std::string token = "0123456789abcdef";
  if (!gateway::demand_token(request, token) && text.find(token) == std::string::npos) std::abort();
  return 0;
}
