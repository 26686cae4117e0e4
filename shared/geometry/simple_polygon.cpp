// SPDX-License-Identifier: Apache-2.0
#include "geometry/simple_polygon.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace crane {
namespace {

constexpr double kSmallest_m2 = 1e-4;
constexpr double kSamePlace_m = 1e-6;

/// Twice the area of a triangle; zero within what the numbers can tell.
double side(const Corner& a, const Corner& b, const Corner& c) {
  const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  const double longest =
      std::max(std::hypot(b.x - a.x, b.y - a.y), std::hypot(c.x - a.x, c.y - a.y));
  return std::abs(area) <= kSamePlace_m * longest ? 0 : area;
}

bool between(const Corner& a, const Corner& b, const Corner& p) {
  return std::min(a.x, b.x) <= p.x + kSamePlace_m && p.x <= std::max(a.x, b.x) + kSamePlace_m &&
         std::min(a.y, b.y) <= p.y + kSamePlace_m && p.y <= std::max(a.y, b.y) + kSamePlace_m;
}

bool on_edge(const Corner& a, const Corner& b, const Corner& p) {
  return side(a, b, p) == 0 && between(a, b, p);
}

/// Whether two edges have a point in common.
bool meet(const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
  const double c_side = side(a, b, c), d_side = side(a, b, d);
  const double a_side = side(c, d, a), b_side = side(c, d, b);
  if (c_side * d_side < 0 && a_side * b_side < 0) return true;
  return on_edge(a, b, c) || on_edge(a, b, d) || on_edge(c, d, a) || on_edge(c, d, b);
}

std::string pair_of(std::size_t a, std::size_t b) {
  return std::to_string(a + 1) + " and " + std::to_string(b + 1);
}

}  // namespace

std::string polygon_flaw(const std::vector<Corner>& corners) {
  const std::size_t n = corners.size();
  if (n < 3) return "has fewer than three corners";
  for (std::size_t i = 0; i < n; ++i)
    if (!std::isfinite(corners[i].x) || !std::isfinite(corners[i].y))
      return "has a corner (" + std::to_string(i + 1) + ") that is not finite";
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = i + 1; k < n; ++k)
      if (std::hypot(corners[i].x - corners[k].x, corners[i].y - corners[k].y) < kSamePlace_m)
        return "has corners " + pair_of(i, k) + " in the same place: each is named once";
  double area = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Corner& a = corners[i];
    const Corner& b = corners[(i + 1) % n];
    area += 0.5 * ((a.x - corners[0].x) * (b.y - corners[0].y) -
                   (b.x - corners[0].x) * (a.y - corners[0].y));
    // A corner at which the border turns back upon itself.
    const Corner& c = corners[(i + 2) % n];
    if (on_edge(a, b, c) || on_edge(b, c, a))
      return "has no area at corner " + std::to_string((i + 1) % n + 1) +
             ": the border turns back upon itself";
  }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = i + 2; k < n; ++k) {
      if ((k + 1) % n == i) continue;  // neighbours
      if (meet(corners[i], corners[i + 1], corners[k], corners[(k + 1) % n]))
        return "has edges that cross (after corners " + pair_of(i, k) +
               "): name the corners in their order around it";
    }
  if (std::abs(area) < kSmallest_m2) return "has an area of less than 1 cm2";
  return "";
}

}  // namespace crane
