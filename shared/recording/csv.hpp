// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"

namespace crane {

/// Lines of `<time in ns>,<text>` as in ASL/EuRoC data.csv; '#' starts a comment line.
/// Times must be positive and strictly increasing.
/// Error: BadData with file, line and what is wrong.
Result<std::vector<std::pair<TimeNs, std::string>>> parse_time_csv(const std::string& text,
                                                                   const std::string& name);
Result<std::vector<std::pair<TimeNs, std::string>>> read_time_csv(const std::string& path);

}  // namespace crane
