// SPDX-License-Identifier: Apache-2.0
#pragma once

// "May the load go there, how high must it be, and how do you know?" C++17 standard library only.

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace crane::client {

/// Where the load is: the middle of its underside in the map frame, and its turn about z.
struct Pose {
  double x_m = 0, y_m = 0, z_m = 0;
  double yaw_rad = 0;  ///< from map x to the load's own x
};

/// Load::above_m: up to the rope's top, as Status::ceiling_m says it.
inline constexpr double kToRopeTop = -1;

/// A box, along its own axes.
struct Load {
  double size_x_m = 0, size_y_m = 0, size_z_m = 0;
  /// So much above the box must be free as well, over all its footprint: slings, hook and rope are
  /// there. What hangs higher is not looked at, so the default leaves nothing out; whoever says
  /// less answers for what is above.
  double above_m = kToRopeTop;
};

struct Margins {
  double horizontal_m = 0.2, vertical_m = 0.2;
  double sway_m = 0;     ///< added to horizontal_m: the load beside the trolley
  double braking_m = 0;  ///< each leg goes on so far beyond its end
};

struct ClearanceQuery {
  std::vector<Pose> path;  ///< straight legs, turned evenly; one pose: the load stays there
  Load load;
  Margins margins;
  double max_age_s = 0;  ///< columns seen longer ago count as unknown; 0 = of any age
  /// Columns whose height rests on fewer frames block; 0 and 1 = no such demand. Space that is
  /// free is free by what one frame saw: frames are counted for surfaces only.
  std::uint32_t min_views = 1;
  std::int64_t now_ns = 0;  ///< what ages are counted from, Unix epoch; 0 = the system's clock
};

/// The first value is what nothing was asked of.
enum class Verdict { kInvalid, kClear, kBlocked };

enum class Reason {
  kNone,
  kMapInvalid,  ///< no heartbeat, not complete, stale sensors: text says which
  kBadQuery,    ///< text says what
  kObstacle,    ///< something stands in the way
  kUnknown,     ///< part of the way was never seen: unknown is not free
  kStale,       ///< part of it was seen longer ago than max_age_s, or is forgotten
  kZone,        ///< a no-go zone
  kFewViews,    ///< a surface below rests on fewer frames than min_views
};

struct Clearance {
  Verdict verdict = Verdict::kInvalid;
  Reason reason = Reason::kNone;  ///< of the first blocking point
  std::string text;               ///< the same in words
  /// Next clear height of the underside at or above the asked one: that at which the whole path,
  /// flown level, is clear. Asked is the highest pose. NaN when there is none above: it is never
  /// an advice to go lower.
  double safe_height_m = std::numeric_limits<double>::quiet_NaN();
  /// All heights of the underside from safe_low_m to safe_high_m are clear as well; NaN with it.
  double safe_low_m = std::numeric_limits<double>::quiet_NaN();
  double safe_high_m = std::numeric_limits<double>::quiet_NaN();
  double first_x_m = 0, first_y_m = 0, first_z_m = 0;  ///< first blocking point along the path
  double oldest_age_s = 0;      ///< of the columns under the swept area; -1 = one was never seen
  double unknown_fraction = 0;  ///< share of the swept columns with anything unknown, or stale
  std::uint64_t columns = 0;    ///< swept
  bool slow_down = false;       ///< part of the way is in a slow-down zone
  std::uint32_t zone = 0;       ///< the no-go zone of kZone, else a slow-down zone; 0 = none
  std::uint64_t map_id = 0, revision = 0;  ///< of the map that the answer is made of
};

/// Rectangle along the map's axes.
struct Area {
  double x0_m = 0, y0_m = 0, x1_m = 0, y1_m = 0;
};

struct AreaHeight {
  double max_height_m = 0;  ///< NaN when nothing is known
  double unknown_fraction = 1;
  std::int64_t oldest_observed_ns = 0;  ///< of the known columns
  double lower_bound_fraction = 0;      ///< share of the columns that may be higher: so may the max
  std::uint32_t fewest_views = 0;       ///< frames that the least seen known column rests on
};

}  // namespace crane::client
