// SPDX-License-Identifier: Apache-2.0
#include "gateway/token.hpp"

#include <algorithm>
#include <string_view>

#include "base/read_file.hpp"
#include "http/query.hpp"

namespace crane::gateway {
namespace {

constexpr std::string_view kCookie = "cranemap=";

/// In a time that does not tell where they differ.
bool same(std::string_view one, std::string_view other) {
  unsigned difference = one.size() == other.size() ? 0 : 1;
  for (std::size_t i = 0; i < one.size(); ++i)
    difference |= static_cast<unsigned char>(one[i]) ^
                  static_cast<unsigned char>(other[i < other.size() ? i : 0]);
  return difference == 0;
}

bool cookie_has(std::string_view cookies, std::string_view token) {
  while (!cookies.empty()) {
    const std::string_view one = cookies.substr(0, cookies.find(';'));
    if (one.starts_with(kCookie) && same(one.substr(kCookie.size()), token)) return true;
    cookies.remove_prefix(std::min(cookies.size(), one.size() + 1));
    while (cookies.starts_with(' ')) cookies.remove_prefix(1);
  }
  return false;
}

}  // namespace

Result<std::string> read_token(const std::string& path) {
  auto file = read_file(path, 4096);
  if (!file) return Error{ErrorCode::kConfiguration, "gateway.token_file", file.error().text(), ""};
  std::string token = file->substr(0, file->find_first_of("\r\n"));
  const bool sound = std::all_of(token.begin(), token.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' ||
           c == '_';
  });
  if (token.size() >= 16 && sound) return token;
  return Error{ErrorCode::kConfiguration, path,
               "its first line is no token: 16 or more of A-Z a-z 0-9 - _",
               "openssl rand -hex 16 > " + path};
}

std::optional<http::Response> demand_token(const http::Request& request, const std::string& token) {
  constexpr std::string_view kBearer = "Bearer ";
  const std::string_view authorization = request.authorization;
  if (authorization.starts_with(kBearer) && same(authorization.substr(kBearer.size()), token))
    return std::nullopt;
  if (cookie_has(request.cookie, token)) return std::nullopt;
  auto query = http::parse_query(request.query());
  if (request.method == "GET" && query && same((*query)["token"], token)) {
    if (request.upgrade) return std::nullopt;  // a viewer's WebSocket has nothing but its URL
    return http::Response{
        303,
        "",
        "text/plain; charset=utf-8",
        {{"Location", "/"},
         {"Set-Cookie", std::string(kCookie) + token + "; Path=/; HttpOnly; SameSite=Strict" +
                            (request.secure ? "; Secure" : "")}}};
  }
  return http::Response{401,
                        "A token is needed: open /?token=TOKEN, or send 'Authorization: Bearer "
                        "TOKEN'. It stands in the file gateway.token_file.\n",
                        "text/plain; charset=utf-8",
                        {{"WWW-Authenticate", "Bearer"}}};
}

}  // namespace crane::gateway
