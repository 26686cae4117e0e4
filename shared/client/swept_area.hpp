// SPDX-License-Identifier: Apache-2.0
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
  double load_top_m = 0;                                      ///< what is higher hangs above it
  double start_x = 0, start_y = 0, along_x = 0, along_y = 0;  ///< its beginning and direction
};

/// How high the space must be free over a load whose underside is at z_m, margin included: by
/// Load::above_m, or up to `ceiling_m` and never lower than the box itself.
double top_m(const ClearanceQuery& query, double z_m, double ceiling_m);

/// The volume that load and margins sweep along a path, legs lengthened by the braking distance.
/// Legs that climb or turn are cut, so that the pieces hold hardly more than is swept: by `step_m`
/// sideways and two of them in height. `ceiling_m`: see top_m().
std::vector<SweptPiece> sweep(const ClearanceQuery& query, double step_m, double ceiling_m = 0);

/// What sweep() makes, counted and not made.
struct SweepSize {
  double pieces = 0;
  double columns = 0;  ///< at least so many cells of step_m touch the pieces' polygons, all in all
};
SweepSize sweep_size(const ClearanceQuery& query, double step_m);

}  // namespace crane::client
