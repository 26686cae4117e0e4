// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

namespace crane {

/// Where the first byte stands that is not UTF-8; npos: nowhere.
std::size_t first_not_utf8(const std::string& text);

/// The text with each byte that is not UTF-8 written as \\xe4, for JSON and logs: a file's name
/// may be any bytes.
std::string with_bytes_escaped(const std::string& text);

}  // namespace crane
