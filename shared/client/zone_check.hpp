// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "client/swept_area.hpp"
#include "crane/client/zone.hpp"

namespace crane::client {

/// Where along a piece of the path its polygon first meets that of a zone.
struct ZoneMeeting {
  double x_m = 0, y_m = 0;
  double along = 0;  ///< as the piece's start and direction count
};

/// Nothing when they share no point. The zone's polygon need not be convex. Exact but for rounding;
/// cost O(corners of one times corners of the other).
std::optional<ZoneMeeting> meet(const SweptPiece& piece, const Zone& zone);

/// Whether the heights overlap.
bool same_heights(const SweptPiece& piece, const Zone& zone);

}  // namespace crane::client
