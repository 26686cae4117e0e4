// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace crane::http {

/// Adds the bytes to `out` in base64 (RFC 4648), padded, without line ends. At most 1 GiB.
void add_base64(std::string& out, std::string_view bytes);

}  // namespace crane::http
