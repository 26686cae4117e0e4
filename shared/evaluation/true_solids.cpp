// SPDX-License-Identifier: Apache-2.0
#include "evaluation/true_solids.hpp"

#include <algorithm>
#include <cmath>

#include "base/read_file.hpp"

namespace crane {
namespace {

constexpr double kSlack = 0.02;  ///< [m] cells are a centimetre, heights a millimetre

struct Local {
  double x = 0, y = 0;
};

Local to_local(const TrueObstacle& o, double x, double y) {
  const double c = std::cos(o.yaw_rad), s = std::sin(o.yaw_rad);
  const double dx = x - o.x_m, dy = y - o.y_m;
  return {c * dx + s * dy, c * dy - s * dx};
}

/// A rod, cable or chain: whether the cell lies beside its axis, at its height.
bool fits_line(const TrueObstacle& o, double x, double y, double z) {
  const double ax = o.from_m[0], ay = o.from_m[1];
  const double dx = o.to_m[0] - ax, dy = o.to_m[1] - ay;
  const double length2 = dx * dx + dy * dy;
  const double share =
      length2 > 0 ? std::clamp(((x - ax) * dx + (y - ay) * dy) / length2, 0.0, 1.0) : 0;
  if (std::hypot(x - ax - share * dx, y - ay - share * dy) > o.radius_m + kSlack) return false;
  const double low = std::min(o.from_m[2], o.to_m[2]) - o.sag_m - o.radius_m - kSlack;
  return z >= low && z <= o.height_m + kSlack;
}

bool fits(const TrueObstacle& o, double x, double y, double z) {
  if (o.is_line()) return fits_line(o, x, y, z);
  const Local p = to_local(o, x, y);
  const auto within = [&](double half_x, double half_y) {
    return std::abs(p.x) <= half_x + 1e-9 && std::abs(p.y) <= half_y + 1e-9;
  };
  if (o.kind == "pipe")
    return within(o.length_m / 2, o.radius_m) && z <= o.height_m + kSlack &&
           z >= o.height_m - 2 * o.radius_m - kSlack;
  if (o.kind == "chair")
    return within(o.size_x_m / 2, o.size_y_m / 2) && z > kSlack && z <= o.height_m + kSlack;
  if (o.kind == "wedge")
    return within(o.size_x_m / 2, o.size_y_m / 2) && z > kSlack && z <= o.height_m + kSlack;
  const bool round = o.size_x_m <= 0;
  const bool inside =
      round ? std::hypot(p.x, p.y) <= o.radius_m + 1e-9 : within(o.size_x_m / 2, o.size_y_m / 2);
  return inside && std::abs(z - o.height_m) <= kSlack;
}

/// Recordings of before do not say the base. What is half a metre across then stands on the floor;
/// of less, like a fork or a bar, nothing is known.
bool stands_on_floor(const TrueObstacle& o) {
  constexpr double kLarge = 0.5;
  return 2 * o.level_radius_m() >= kLarge;
}

}  // namespace

std::int64_t TrueSolids::cell_at(double x, double y) const {
  const double c = std::floor((x - heights.origin_x_m) / heights.cell_m);
  const double r = std::floor((y - heights.origin_y_m) / heights.cell_m);
  if (!(c >= 0 && r >= 0 && c < heights.columns && r < heights.rows)) return -1;
  return static_cast<std::int64_t>(r) * heights.columns + static_cast<std::int64_t>(c);
}

double TrueSolids::bottom_m(std::size_t cell) const {
  const double top = heights.height_m(cell);
  if (owner[cell] == kNobody) return top;
  const TrueObstacle& o = obstacles[static_cast<std::size_t>(owner[cell])];
  if (o.kind != "box" && o.kind != "cylinder" && o.kind != "wedge") return top;
  if (std::isfinite(o.base_m)) return std::min(top, o.base_m);
  return stands_on_floor(o) ? 0 : top;
}

TrueSolids make_solids(HeightMap heights, std::vector<TrueObstacle> obstacles) {
  TrueSolids out{std::move(heights), std::move(obstacles), {}};
  const HeightMap& h = out.heights;
  out.owner.assign(h.height_mm.size(), TrueSolids::kNobody);
  const std::size_t count = std::min<std::size_t>(out.obstacles.size(), 32'000);
  for (std::size_t n = 0; n < count; ++n) {
    const TrueObstacle& o = out.obstacles[n];
    double x0 = o.x_m, x1 = o.x_m, y0 = o.y_m, y1 = o.y_m;
    double reach = std::hypot(std::max(o.size_x_m, o.length_m), o.size_y_m) / 2 + o.radius_m;
    if (o.is_line()) {
      x0 = std::min(o.from_m[0], o.to_m[0]), x1 = std::max(o.from_m[0], o.to_m[0]);
      y0 = std::min(o.from_m[1], o.to_m[1]), y1 = std::max(o.from_m[1], o.to_m[1]);
      reach = o.radius_m;
    }
    reach += kSlack;
    const auto index = [&](double m, double origin, std::uint32_t cells) {
      return static_cast<std::uint32_t>(
          std::clamp(std::floor((m - origin) / h.cell_m), 0.0, double(cells)));
    };
    const std::uint32_t c1 = std::min(h.columns, index(x1 + reach, h.origin_x_m, h.columns) + 1);
    const std::uint32_t r1 = std::min(h.rows, index(y1 + reach, h.origin_y_m, h.rows) + 1);
    for (std::uint32_t r = index(y0 - reach, h.origin_y_m, h.rows); r < r1; ++r)
      for (std::uint32_t c = index(x0 - reach, h.origin_x_m, h.columns); c < c1; ++c) {
        const std::size_t cell = std::size_t(r) * h.columns + c;
        if (out.owner[cell] == TrueSolids::kNobody && h.seen(cell) &&
            fits(o, h.x_m(cell), h.y_m(cell), h.height_m(cell)))
          out.owner[cell] = static_cast<std::int16_t>(n);
      }
  }
  return out;
}

Result<TrueSolids> read_truth(const std::string& folder) {
  auto heights = read_height_map(folder + "/height_map.png");
  if (!heights) return heights.error();
  const std::string file = folder + "/obstacles.yaml";
  std::vector<TrueObstacle> obstacles;
  const auto there = is_there(file);
  if (!there) return there.error();
  if (*there) {
    auto read = read_obstacles(file);
    if (!read) return read.error();
    obstacles = *read;
  }
  return make_solids(*std::move(heights), std::move(obstacles));
}

}  // namespace crane
