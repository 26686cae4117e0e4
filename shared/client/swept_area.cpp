// SPDX-License-Identifier: Apache-2.0
#include "client/swept_area.hpp"

#include <algorithm>
#include <cmath>

namespace crane::client {
namespace {

struct Leg {
  Pose from, to;
};

/// Straight legs of a path, and after each the way on while the load brakes. One pose: it stays.
std::vector<Leg> legs_of(const ClearanceQuery& query) {
  std::vector<Leg> out;
  const std::vector<Pose>& path = query.path;
  if (path.size() == 1) out.push_back({path[0], path[0]});
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    out.push_back({path[i], path[i + 1]});
    const double dx = path[i + 1].x_m - path[i].x_m;
    const double dy = path[i + 1].y_m - path[i].y_m;
    const double length = std::hypot(dx, dy);
    if (!(query.margins.braking_m > 0) || !(length > 0)) continue;
    Pose beyond = path[i + 1];
    beyond.x_m += dx / length * query.margins.braking_m;
    beyond.y_m += dy / length * query.margins.braking_m;
    out.push_back({path[i + 1], beyond});
  }
  return out;
}

/// The load's rectangle with its margins, and into how many pieces a leg is cut.
struct Cut {
  double half_x = 0, half_y = 0, length = 0, bulge = 0;
  double pieces = 1;
};

Cut cut(const ClearanceQuery& q, const Leg& leg, double step_m) {
  Cut out;
  const double margin = q.margins.horizontal_m + q.margins.sway_m;
  out.half_x = q.load.size_x_m / 2 + margin;
  out.half_y = q.load.size_y_m / 2 + margin;
  const double turn = std::abs(leg.to.yaw_rad - leg.from.yaw_rad);
  const double radius = std::hypot(out.half_x, out.half_y);
  // Turning while moving, a side bends away from the chord between two poses: by a quarter and by
  // half a step at most.
  out.length = std::hypot(leg.to.x_m - leg.from.x_m, leg.to.y_m - leg.from.y_m);
  const double turns = std::sqrt(turn * std::max(radius * turn / 2, out.length / 4) / step_m);
  const double climbs = std::abs(leg.to.z_m - leg.from.z_m) / (2 * step_m);
  out.pieces = std::max(1.0, std::ceil(std::max(turns, climbs)));
  // A turning corner leaves the chord between two poses by at most this.
  out.bulge = radius * turn * turn / (8.0 * out.pieces * out.pieces);
  return out;
}

void add_corners(const Pose& p, double half_x, double half_y, std::vector<Corner>& out) {
  const double c = std::cos(p.yaw_rad);
  const double s = std::sin(p.yaw_rad);
  for (const double x : {-half_x, half_x})
    for (const double y : {-half_y, half_y})
      out.push_back({p.x_m + c * x - s * y, p.y_m + s * x + c * y});
}

Pose between(const Pose& a, const Pose& b, double share) {
  return {a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m),
          a.z_m + share * (b.z_m - a.z_m), a.yaw_rad + share * (b.yaw_rad - a.yaw_rad)};
}

void sweep_leg(const ClearanceQuery& q, const Leg& leg, double step_m, double ceiling_m,
               std::vector<SweptPiece>& out) {
  const Cut cut_up = cut(q, leg, step_m);
  const double half_x = cut_up.half_x + cut_up.bulge;
  const double half_y = cut_up.half_y + cut_up.bulge;
  const int count = static_cast<int>(cut_up.pieces);
  for (int i = 0; i < count; ++i) {
    const Pose a = between(leg.from, leg.to, double(i) / count);
    const Pose b = between(leg.from, leg.to, double(i + 1) / count);
    SweptPiece piece;
    std::vector<Corner> corners;
    add_corners(a, half_x, half_y, corners);
    add_corners(b, half_x, half_y, corners);
    piece.hull = convex_hull(std::move(corners));
    piece.low_m = std::min(a.z_m, b.z_m) - q.margins.vertical_m;
    piece.high_m = top_m(q, std::max(a.z_m, b.z_m), ceiling_m);
    piece.load_top_m = std::max(a.z_m, b.z_m) + q.load.size_z_m + q.margins.vertical_m;
    piece.start_x = a.x_m;
    piece.start_y = a.y_m;
    piece.along_x = b.x_m - a.x_m;
    piece.along_y = b.y_m - a.y_m;
    out.push_back(std::move(piece));
  }
}

}  // namespace

double top_m(const ClearanceQuery& q, double z_m, double ceiling_m) {
  const double box = z_m + q.load.size_z_m + q.margins.vertical_m;
  return q.load.above_m < 0 ? std::max(box, ceiling_m) : box + q.load.above_m;
}

std::vector<SweptPiece> sweep(const ClearanceQuery& query, double step_m, double ceiling_m) {
  std::vector<SweptPiece> out;
  for (const Leg& leg : legs_of(query)) sweep_leg(query, leg, step_m, ceiling_m, out);
  return out;
}

SweepSize sweep_size(const ClearanceQuery& query, double step_m) {
  SweepSize out;
  for (const Leg& leg : legs_of(query)) {
    const Cut c = cut(query, leg, step_m);
    const double x = 2 * (c.half_x + c.bulge);
    const double y = 2 * (c.half_y + c.bulge);
    const double length = c.length / c.pieces;
    // A piece's polygon lies within the load's circle moved along; it has no more cells than its
    // area and twice its outline hold.
    const double around = std::hypot(x, y);
    const bool turns = leg.from.yaw_rad != leg.to.yaw_rad;
    const double area = (turns ? around * around : x * y) + length * around;
    const double outline = 4 * around + 2 * length;
    out.pieces += c.pieces;
    out.columns += c.pieces * (area / (step_m * step_m) + 2 * outline / step_m + 4);
  }
  return out;
}

}  // namespace crane::client
