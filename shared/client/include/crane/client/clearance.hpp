#pragma once

// "May the load go there, how high must it be, and how do you know?" C++17 standard library only.

#include <cstdint>
#include <string>
#include <vector>

namespace crane::client {

/// Where the load is: the middle of its underside in the map frame, and its turn about z.
struct Pose {
  double x_m = 0, y_m = 0, z_m = 0;
  double yaw_rad = 0;  ///< from map x to the load's own x
};

/// A box, along its own axes.
struct Load {
  double size_x_m = 0, size_y_m = 0, size_z_m = 0;
  double above_m = 0;  ///< of hook and rope above the load that must be free as well
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
  double max_age_s = 0;     ///< columns seen longer ago count as unknown; 0 = of any age
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
};

struct Clearance {
  Verdict verdict = Verdict::kInvalid;
  Reason reason = Reason::kNone;  ///< of the first blocking point
  std::string text;               ///< the same in words
  /// Lowest height of the underside at which the whole path is clear, with nothing known above it;
  /// NaN when there is none.
  double safe_height_m = 0;
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
};

}  // namespace crane::client
