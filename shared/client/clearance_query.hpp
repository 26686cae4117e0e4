// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "crane/client/clearance.hpp"
#include "crane/client/zone.hpp"

namespace crane::client {

/// What makes a query senseless, or more than one answer may cost, in words; empty = nothing.
/// Every pose, climb and turn counts, and every zone it is compared with: what is let through is
/// answered within tens of milliseconds, whatever its numbers are.
std::string query_flaw(const ClearanceQuery& query, double voxel_m,
                       const std::vector<Zone>* zones = nullptr);

}  // namespace crane::client
