// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.hpp"
#include "service/run_service.hpp"

namespace crane::gateway {

/// Follows the map and what services, rangefinders and the crane's controller say, and serves it,
/// until the service stops. `calibration` may be empty. Error: Configuration, Resource.
Result<void> serve(ServiceContext& context, const std::string& calibration,
                   const std::string& page_folder);

}  // namespace crane::gateway
