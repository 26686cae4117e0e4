// SPDX-License-Identifier: Apache-2.0
#include "client/zone_check.hpp"

namespace crane::client {
namespace {

using Point = Zone::Corner;

double cross(const Point& o, const Point& a, const Point& b) {
  return (a.x_m - o.x_m) * (b.y_m - o.y_m) - (a.y_m - o.y_m) * (b.x_m - o.x_m);
}

/// Even-odd rule; points on the border may be either.
bool contains(const std::vector<Point>& polygon, const Point& p) {
  bool in = false;
  for (std::size_t i = 0, k = polygon.size() - 1; i < polygon.size(); k = i++) {
    const Point& a = polygon[i];
    const Point& b = polygon[k];
    if ((a.y_m > p.y_m) == (b.y_m > p.y_m)) continue;
    if (p.x_m < (b.x_m - a.x_m) * (p.y_m - a.y_m) / (b.y_m - a.y_m) + a.x_m) in = !in;
  }
  return in;
}

/// Where two line segments cross or touch; parallel ones do at their ends, which others find.
std::optional<Point> crossing(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double ab_c = cross(a, b, c);
  const double ab_d = cross(a, b, d);
  const double cd_a = cross(c, d, a);
  const double cd_b = cross(c, d, b);
  if ((ab_c > 0 && ab_d > 0) || (ab_c < 0 && ab_d < 0) || (cd_a > 0 && cd_b > 0) ||
      (cd_a < 0 && cd_b < 0) || cd_a == cd_b)
    return std::nullopt;
  const double share = cd_a / (cd_a - cd_b);
  return Point{a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m)};
}

}  // namespace

bool same_heights(const SweptPiece& piece, const Zone& zone) {
  constexpr double kTouching = 1e-7;  // [m]: by rounding, they do not overlap
  return zone.z_min_m + kTouching < piece.high_m && piece.low_m + kTouching < zone.z_max_m;
}

std::optional<ZoneMeeting> meet(const SweptPiece& piece, const Zone& zone) {
  std::optional<ZoneMeeting> first;
  // The part that both share has its corners among these; one of them comes first along the path.
  const auto see = [&](const Point& p) {
    const double along =
        (p.x_m - piece.start_x) * piece.along_x + (p.y_m - piece.start_y) * piece.along_y;
    if (!first || along < first->along) first = {p.x_m, p.y_m, along};
  };
  std::vector<Point> hull;
  hull.reserve(piece.hull.size());
  for (const Corner& c : piece.hull) hull.push_back({c.x, c.y});
  if (hull.empty() || zone.corners.empty()) return first;
  for (std::size_t i = 0; i < hull.size(); ++i)
    for (std::size_t k = 0; k < zone.corners.size(); ++k)
      if (const auto p = crossing(hull[i], hull[(i + 1) % hull.size()], zone.corners[k],
                                  zone.corners[(k + 1) % zone.corners.size()]))
        see(*p);
  for (const Point& p : hull)
    if (contains(zone.corners, p)) see(p);
  for (const Point& p : zone.corners)
    if (contains(hull, p)) see(p);
  return first;
}

}  // namespace crane::client
