#include "client/swept_area.hpp"

#include <algorithm>
#include <cmath>

namespace crane::client {
namespace {

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

void sweep_leg(const ClearanceQuery& q, const Pose& from, const Pose& to, double step_m,
               std::vector<SweptPiece>& out) {
  const double margin = q.margins.horizontal_m + q.margins.sway_m;
  const double half_x = q.load.size_x_m / 2 + margin;
  const double half_y = q.load.size_y_m / 2 + margin;
  const double turn = std::abs(to.yaw_rad - from.yaw_rad);
  const double radius = std::hypot(half_x, half_y);
  // Turning while moving, a side bends away from the chord between two poses: by a quarter and by
  // half a step at most.
  const double length = std::hypot(to.x_m - from.x_m, to.y_m - from.y_m);
  const double turns = std::sqrt(turn * std::max(radius * turn / 2, length / 4) / step_m);
  const double climbs = std::abs(to.z_m - from.z_m) / (2 * step_m);
  const int count = std::max(1, static_cast<int>(std::ceil(std::max(turns, climbs))));
  // A turning corner leaves the chord between two poses by at most this.
  const double bulge = radius * turn * turn / (8.0 * count * count);
  for (int i = 0; i < count; ++i) {
    const Pose a = between(from, to, double(i) / count);
    const Pose b = between(from, to, double(i + 1) / count);
    SweptPiece piece;
    std::vector<Corner> corners;
    add_corners(a, half_x + bulge, half_y + bulge, corners);
    add_corners(b, half_x + bulge, half_y + bulge, corners);
    piece.hull = convex_hull(std::move(corners));
    piece.low_m = std::min(a.z_m, b.z_m) - q.margins.vertical_m;
    piece.high_m = std::max(a.z_m, b.z_m) + q.load.size_z_m + q.load.above_m + q.margins.vertical_m;
    piece.start_x = a.x_m;
    piece.start_y = a.y_m;
    piece.along_x = b.x_m - a.x_m;
    piece.along_y = b.y_m - a.y_m;
    out.push_back(std::move(piece));
  }
}

}  // namespace

std::vector<SweptPiece> sweep(const ClearanceQuery& query, double step_m) {
  std::vector<SweptPiece> out;
  const std::vector<Pose>& path = query.path;
  if (path.size() == 1) sweep_leg(query, path[0], path[0], step_m, out);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    sweep_leg(query, path[i], path[i + 1], step_m, out);
    const double dx = path[i + 1].x_m - path[i].x_m;
    const double dy = path[i + 1].y_m - path[i].y_m;
    const double length = std::hypot(dx, dy);
    if (!(query.margins.braking_m > 0) || !(length > 0)) continue;
    Pose beyond = path[i + 1];
    beyond.x_m += dx / length * query.margins.braking_m;
    beyond.y_m += dy / length * query.margins.braking_m;
    sweep_leg(query, path[i + 1], beyond, step_m, out);
  }
  return out;
}

}  // namespace crane::client
