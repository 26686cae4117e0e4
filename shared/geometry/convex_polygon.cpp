// SPDX-License-Identifier: Apache-2.0
#include "geometry/convex_polygon.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace crane {
namespace {

double cross(const Corner& o, const Corner& a, const Corner& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

}  // namespace

std::vector<Corner> convex_hull(std::vector<Corner> points) {
  if (points.size() < 3) return points;
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

std::vector<PolygonRow> rows_of(const std::vector<Corner>& hull, double cell_size) {
  double low = std::numeric_limits<double>::max();
  double high = -low;
  for (const Corner& c : hull) low = std::min(low, c.y), high = std::max(high, c.y);
  const auto cell = [cell_size](double v) { return static_cast<int>(std::floor(v / cell_size)); };
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
      const double x = a.x + (border * cell_size - a.y) / (b.y - a.y) * (b.x - a.x);
      see(border - 1, x);
      see(border, x);
    }
  }
  std::vector<PolygonRow> rows;
  for (int row = first; row <= last; ++row) {
    const Corner& e = extent[static_cast<std::size_t>(row - first)];
    if (e.x <= e.y) rows.push_back({row, cell(e.x), cell(e.y)});
  }
  return rows;
}

}  // namespace crane
