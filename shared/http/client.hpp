// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

#include "base/result.hpp"
#include "http/message.hpp"

namespace crane::http {

/// GET of a path. Error: NotAvailable when there is no whole answer within `limit`.
Result<Response> get(const std::string& address, int port, const std::string& path,
                     std::chrono::milliseconds limit = std::chrono::seconds(2));

}  // namespace crane::http
