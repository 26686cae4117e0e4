// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "crane/client/clearance.hpp"
#include "evaluation/judged_map.hpp"
#include "evaluation/true_solids.hpp"

namespace crane {

struct ClearanceTrialOptions {
  std::size_t queries = 20'000;
  std::uint64_t seed = 1;
  /// Around the load, on all sides; < 0: one voxel, which is what a map can promise at best.
  double margin_m = -1;
};

/// What a controller would have been told, against what really stands there.
struct ClearanceTrial {
  std::size_t queries = 0, clear = 0, blocked = 0, invalid = 0;
  std::size_t wrong_clear = 0;  ///< of clear: the load itself would have hit something
  /// The first of them: the query, and the highest true point that the load meets.
  client::ClearanceQuery first;
  double first_x_m = 0, first_y_m = 0, first_true_m = 0;
};

/// Answers a query from the map.
using Ask = std::function<client::Clearance(const client::ClearanceQuery&)>;
/// As the client library answers from this map.
Ask ask(const JudgedMap& map);

/// Asks about loads of random size, place, turn and height, at rest or on a level leg, half of them
/// close to what stands there, with a margin. A CLEAR
/// is wrong when true matter lies within the load itself: below a surface no deeper than known
/// solid (TrueSolids::bottom_m), so that passing under a pipe is not held against the map.
ClearanceTrial try_clearance(const TrueSolids& truth, double voxel_m, const Ask& ask,
                             const ClearanceTrialOptions& options);

/// The highest true point within the volume that the load sweeps; -1 = nothing is hit. For tests.
std::int64_t cell_hit(const TrueSolids& truth, client::ClearanceQuery query);

}  // namespace crane
