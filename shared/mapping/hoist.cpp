// SPDX-License-Identifier: Apache-2.0
#include "mapping/hoist.hpp"

#include <algorithm>

namespace crane {
namespace {

Eigen::Vector2d at_rest(const HoistGeometry& g, const Eigen::Vector2d& gantry_m) {
  return gantry_m + g.offset_m;
}

void add_square(const Eigen::Vector2d& centre, double half, double z,
                std::vector<Eigen::Vector3d>& out) {
  for (const double x : {-half, half})
    for (const double y : {-half, half}) out.emplace_back(centre.x() + x, centre.y() + y, z);
}

}  // namespace

std::vector<Eigen::Vector3d> UprightBox::corners(const Eigen::Vector3d& more) const {
  const Eigen::Vector3d size = half + more;
  const Eigen::AngleAxisd turn(yaw_rad, Eigen::Vector3d::UnitZ());
  std::vector<Eigen::Vector3d> out;
  for (int i = 0; i < 8; ++i)
    out.emplace_back(centre + turn * Eigen::Vector3d((i & 1) != 0 ? size.x() : -size.x(),
                                                     (i & 2) != 0 ? size.y() : -size.y(),
                                                     (i & 4) != 0 ? size.z() : -size.z()));
  return out;
}

UprightBox hook_box(const HoistGeometry& g, const HoistReading& r,
                    const Eigen::Vector2d& gantry_m) {
  const Eigen::Vector2d at = at_rest(g, gantry_m) + r.sway_m;
  return {{at.x(), at.y(), r.hook_height_m + g.hook_size_m.z() / 2}, g.hook_size_m / 2, 0};
}

UprightBox load_box(const HoistGeometry& g, const HoistReading& r,
                    const Eigen::Vector2d& gantry_m) {
  const Eigen::Vector2d at = at_rest(g, gantry_m) + r.sway_m;
  return {{at.x(), at.y(), r.hook_height_m - r.sling_m - r.load_size_m.z() / 2},
          r.load_size_m / 2,
          r.load_yaw_rad};
}

Bodies hoist_bodies(const HoistGeometry& g, const HoistReading& r,
                    const Eigen::Vector2d& gantry_m) {
  const Eigen::Vector3d more(g.margin_m + g.sway_m, g.margin_m + g.sway_m, g.margin_m);
  Bodies out(2);
  const UprightBox hook = hook_box(g, r, gantry_m);
  // The rope swings about its upper end.
  add_square(at_rest(g, gantry_m), g.rope_radius_m + g.margin_m, g.rope_top_m + g.margin_m, out[0]);
  add_square(hook.centre.head<2>(), g.rope_radius_m + more.x(), hook.centre.z(), out[0]);
  out[1] = hook.corners(more);
  if (!r.has_load()) return out;
  // With the slings between them.
  const auto load = load_box(g, r, gantry_m).corners(more);
  out[1].insert(out[1].end(), load.begin(), load.end());
  return out;
}

Bodies unknown_hoist_bodies(const HoistGeometry& g, const Eigen::Vector2d& gantry_m) {
  const double reach =
      std::max(g.largest_load_m, g.hook_size_m.head<2>().maxCoeff()) / 2 * std::sqrt(2.0) +
      g.sway_m + g.margin_m;
  Bodies out(1);
  add_square(at_rest(g, gantry_m), reach, 0, out[0]);
  add_square(at_rest(g, gantry_m), reach, g.rope_top_m + g.margin_m, out[0]);
  return out;
}

}  // namespace crane
