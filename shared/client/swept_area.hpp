#pragma once

#include <vector>

#include "crane/client/clearance.hpp"
#include "geometry/convex_polygon.hpp"

namespace crane::client {

/// A stretch of the path over which the load, with its margins, stays within a convex polygon and
/// an interval of heights.
struct SweptPiece {
  std::vector<Corner> hull;                                   ///< counter-clockwise
  double low_m = 0, high_m = 0;                               ///< of all that must be free
  double start_x = 0, start_y = 0, along_x = 0, along_y = 0;  ///< its beginning and direction
};

/// The volume that load and margins sweep along a path, legs lengthened by the braking distance.
/// Legs that climb or turn are cut, so that the pieces hold hardly more than is swept: by `step_m`
/// sideways and two of them in height.
std::vector<SweptPiece> sweep(const ClearanceQuery& query, double step_m);

}  // namespace crane::client
