// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.hpp"
#include "service/run_service.hpp"

namespace crane {

/// Follows the rangefinders of the configuration and publishes what they measure, each with a
/// thread of its own, until the service is to stop. `axis`: only those of this axis; empty = all.
/// Error: Configuration when none is left.
Result<void> follow_rangefinders(ServiceContext& context, const std::string& axis);

}  // namespace crane
