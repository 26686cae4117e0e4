// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "base/result.hpp"

namespace crane {

/// "90", "90s", "10min", "2h", "1.5h" in seconds. Error: Configuration.
Result<double> parse_duration(const std::string& option, const std::string& text);
/// "500MB", "20GB", "1TB", "20GiB" in bytes; a unit must be there. Error: Configuration.
Result<std::uint64_t> parse_size(const std::string& option, const std::string& text);
/// "1.2 GB".
std::string size_text(std::uint64_t bytes);

}  // namespace crane
