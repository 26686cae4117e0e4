// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "geometry/hoist_reading.hpp"

namespace crane {

/// What of hook and rope does not change: measured once on the crane.
struct HoistGeometry {
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero();  ///< hook at rest minus (cart, trolley), map
  double rope_top_m = 10;                              ///< upper end of the rope above the floor
  double rope_radius_m = 0.1;                          ///< of all falls together
  Eigen::Vector3d hook_size_m{0.4, 0.4, 0.5};  ///< hook block, up from the hook's lowest point
  double margin_m = 0.15;                      ///< around everything that is cut out
  double sway_m = 0.1;        ///< sway that the controller does not know of, at the hook
  double largest_load_m = 3;  ///< side of the largest load: while nothing is known of it
  double accuracy_m = 0.05;   ///< of heights and sizes: so much less is proven free
};

/// A box that stands upright.
struct UprightBox {
  Eigen::Vector3d centre{0, 0, 0}, half{0, 0, 0};
  double yaw_rad = 0;

  /// The eight corners of the box with `more` added to its half sizes.
  [[nodiscard]] std::vector<Eigen::Vector3d> corners(const Eigen::Vector3d& more) const;
};

/// Hook block and load with cart and trolley at `gantry_m`. The load hangs below the hook.
UprightBox hook_box(const HoistGeometry& g, const HoistReading& r, const Eigen::Vector2d& gantry_m);
UprightBox load_box(const HoistGeometry& g, const HoistReading& r, const Eigen::Vector2d& gantry_m);

/// Convex bodies, as their corners in the map, that may be rope, hook or load and not workshop.
using Bodies = std::vector<std::vector<Eigen::Vector3d>>;
Bodies hoist_bodies(const HoistGeometry& g, const HoistReading& r, const Eigen::Vector2d& gantry_m);
/// While nothing is known of hook and load: all that hangs or could hang below the trolley.
Bodies unknown_hoist_bodies(const HoistGeometry& g, const Eigen::Vector2d& gantry_m);

}  // namespace crane
