// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// What YAML allows and a configuration must not have, because one reader takes it for this and
/// another for that: a key twice, a second document, a key that is no text, aliases, a nesting
/// that exhausts the stack. Error: Configuration, every place with its line.
Result<void> check_strict_yaml(const std::string& text, const std::string& name);

/// All problems of a file, each "file:line: what", as one error.
Error problems_error(const std::string& name, const std::vector<std::string>& problems);

/// Numbers as everybody reads them: decimal, leading zeros without meaning (010 is ten). Nothing
/// for octal, hexadecimal, 1_000, 1:30, .inf, .nan, or with a unit.
std::optional<double> decimal_number(const std::string& text);
std::optional<int> decimal_integer(const std::string& text);
/// true, false, yes, no, on, off; also Capitalised or in CAPITALS.
std::optional<bool> yes_or_no(const std::string& text);

}  // namespace crane
