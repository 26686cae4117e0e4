// SPDX-License-Identifier: Apache-2.0
#include "geometry/footprint.hpp"

#include <utility>

namespace crane {

std::vector<Eigen::Vector2d> footprint(const StereoRig& rig, const Eigen::Vector2d& gantry_m) {
  std::vector<Eigen::Vector2d> out;
  const CameraModel& c = rig.left;
  const Eigen::Vector3d eye =
      rig.T_map_camera_at_zero.translation() + Eigen::Vector3d(gantry_m.x(), gantry_m.y(), 0);
  for (const auto& [u, v] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}) {
    const Eigen::Vector3d ray((u * c.width - c.cx_px) / c.fx_px, (v * c.height - c.cy_px) / c.fy_px,
                              1);
    const Eigen::Vector3d way = rig.T_map_camera_at_zero.linear() * ray;
    if (way.z() > -1e-3) return {};
    out.push_back((eye + way * (eye.z() / -way.z())).head<2>());
  }
  return out;
}

}  // namespace crane
