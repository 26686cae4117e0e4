// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace crane::http {

/// "a=1&b=x%20y" by name. Nothing: a wrong percent sign, a name twice, no name, bytes that are no
/// text, or more than 32 of them.
std::optional<std::map<std::string, std::string>> parse_query(std::string_view query);

/// All of the text, a finite number, '.' for decimals whatever the locale.
std::optional<double> parse_number(std::string_view text);

}  // namespace crane::http
