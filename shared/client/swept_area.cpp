#include "client/swept_area.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crane::client {
namespace {

double cross(const Corner& o, const Corner& a, const Corner& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

/// Andrew's monotone chain.
std::vector<Corner> convex_hull(std::vector<Corner> points) {
  std::sort(points.begin(), points.end(), [](const Corner& a, const Corner& b) {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
  });
  std::vector<Corner> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t start = hull.size();
    for (const Corner& p : points) {
      while (hull.size() >= start + 2 && cross(hull[hull.size() - 2], hull.back(), p) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
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

std::vector<SweptRow> rows_of(const std::vector<Corner>& hull, double cell_m) {
  double low = std::numeric_limits<double>::max();
  double high = -low;
  for (const Corner& c : hull) low = std::min(low, c.y), high = std::max(high, c.y);
  const auto cell = [cell_m](double v) { return static_cast<int>(std::floor(v / cell_m)); };
  const int first = cell(low);
  const int last = cell(high);
  // Extent in x of the part of the polygon within each row: of its corners there, and of where its
  // edges cross the borders of the row.
  std::vector<Corner> extent(
      static_cast<std::size_t>(last - first + 1),
      {std::numeric_limits<double>::max(), -std::numeric_limits<double>::max()});
  const auto see = [&](int row, double x) {
    Corner& e = extent[static_cast<std::size_t>(std::clamp(row, first, last) - first)];
    e.x = std::min(e.x, x);
    e.y = std::max(e.y, x);
  };
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Corner& a = hull[i];
    const Corner& b = hull[(i + 1) % hull.size()];
    see(cell(a.y), a.x);
    const int r0 = cell(std::min(a.y, b.y));
    const int r1 = cell(std::max(a.y, b.y));
    for (int border = r0 + 1; border <= r1; ++border) {  // between rows border - 1 and border
      const double x = a.x + (border * cell_m - a.y) / (b.y - a.y) * (b.x - a.x);
      see(border - 1, x);
      see(border, x);
    }
  }
  std::vector<SweptRow> rows;
  for (int row = first; row <= last; ++row) {
    const Corner& e = extent[static_cast<std::size_t>(row - first)];
    if (e.x <= e.y) rows.push_back({row, cell(e.x), cell(e.y)});
  }
  return rows;
}

}  // namespace crane::client
