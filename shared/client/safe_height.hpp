// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "client/clearance_check.hpp"
#include "client/swept_area.hpp"

namespace crane::client {

/// Heights of the load's underside, both ends clear.
struct HeightInterval {
  double low_m = 0, high_m = 0;
};

/// Voxels first .. end - 1, one on top of the other.
struct FreeRun {
  int first = 0, end = 0;
};

/// Runs of levels that are free in all columns under the pieces, from below. Cost O(columns).
std::vector<FreeRun> free_runs(const std::vector<SweptPiece>& pieces, const ColumnView& map);

/// Where the underside may be, for the path flown level: the lowest interval that reaches `asked_m`
/// or is above it. `runs`: at least all free runs that reach the asked height or are above it.
/// `no_go`: the zones that the pieces meet, whatever their heights.
std::optional<HeightInterval> next_clear(const ClearanceQuery& query, const ColumnView& map,
                                         const std::vector<FreeRun>& runs,
                                         const std::vector<const Zone*>& no_go, double asked_m);

}  // namespace crane::client
