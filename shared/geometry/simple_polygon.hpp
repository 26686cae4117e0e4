// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "geometry/convex_polygon.hpp"

namespace crane {

/// What keeps corners, in their order, from being the border of one area: fewer than three, one
/// that is not finite, two in the same place, edges that cross or touch, an area of less than
/// 1 cm2. Empty: nothing. Corners are counted from 1. Concave outlines are fine, either way round.
/// Cost O(n^2).
std::string polygon_flaw(const std::vector<Corner>& corners);

}  // namespace crane
