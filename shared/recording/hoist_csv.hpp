// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/hoist_reading.hpp"

namespace crane {

/// Lines of `time [ns],hook height[,sling,load x,load y,load z,load yaw,sway x,sway y]` [m, rad];
/// what is left out is 0. Error: BadData with what is wrong.
Result<std::vector<HoistReading>> parse_hoist_csv(const std::string& text, const std::string& name);
/// The same of a file; none where there is no file.
Result<std::vector<HoistReading>> read_hoist_csv(const std::string& path);

}  // namespace crane
