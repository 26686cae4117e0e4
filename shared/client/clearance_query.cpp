// SPDX-License-Identifier: Apache-2.0
#include "client/clearance_query.hpp"

#include <cmath>

#include "client/swept_area.hpp"

namespace crane::client {
namespace {

constexpr double kFarthest = 1e5;  ///< [m] of any coordinate
constexpr std::size_t kMaxPoses = 256;
constexpr double kMaxColumns = 4e6;     ///< looked at for one answer
constexpr double kColumnsAPiece = 100;  ///< that cost as much as a piece without any
constexpr double kColumnsACorner = 10;  ///< ... as comparing a piece with a corner of a zone
constexpr double kMaxViews = 32;        ///< more frames of a surface are not counted

}  // namespace

std::string query_flaw(const ClearanceQuery& q, double voxel_m, const std::vector<Zone>* zones) {
  const auto within = [](double v, double low, double high) { return v >= low && v <= high; };
  if (q.path.empty()) return "the path has no pose";
  if (q.path.size() > kMaxPoses) return "the path has more than 256 poses";
  for (const Pose& p : q.path)
    if (!within(p.x_m, -kFarthest, kFarthest) || !within(p.y_m, -kFarthest, kFarthest) ||
        !within(p.z_m, -100, 1000) || !within(p.yaw_rad, -100, 100))
      return "a pose is not finite or out of range";
  const Load& l = q.load;
  if (!within(l.size_x_m, 0, 100) || !within(l.size_y_m, 0, 100) || !within(l.size_z_m, 0, 100))
    return "the size of the load is not within 0 .. 100 m";
  if (l.above_m != kToRopeTop && !within(l.above_m, 0, 100))
    return "above_m is neither -1 (to the rope's top) nor within 0 .. 100 m";
  const Margins& m = q.margins;
  if (!within(m.horizontal_m, 0, 100) || !within(m.vertical_m, 0, 100) ||
      !within(m.sway_m, 0, 100) || !within(m.braking_m, 0, 100))
    return "a margin is not within 0 .. 100 m";
  if (!within(q.max_age_s, 0, 1e9)) return "max_age_s is not within 0 .. 1e9 s";
  if (q.min_views > kMaxViews) return "min_views is more than the 32 that are counted";
  const SweepSize size = sweep_size(q, voxel_m);
  double corners = 0;
  if (zones != nullptr)
    for (const Zone& zone : *zones) corners += zone.active ? 1 + double(zone.corners.size()) : 0;
  const double work = size.columns + size.pieces * (kColumnsAPiece + kColumnsACorner * corners);
  if (!(work <= kMaxColumns))
    return "the path sweeps, climbs or turns over more than four million columns: split it";
  return {};
}

}  // namespace crane::client
