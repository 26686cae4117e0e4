// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "base/result.hpp"
#include "http/message.hpp"

namespace crane::gateway {

/// The first line of a file. Error: Configuration when it has fewer than 16 letters, or others than
/// digits, letters, '-', '_'.
Result<std::string> read_token(const std::string& path);

/// Lets a request through that shows the token: "Authorization: Bearer TOKEN", or the cookie that a
/// browser gets once it asked for "/?token=TOKEN"; a WebSocket may show it in its URL each time.
/// Nothing: it may pass.
std::optional<http::Response> demand_token(const http::Request& request, const std::string& token);

}  // namespace crane::gateway
