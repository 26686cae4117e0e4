// SPDX-License-Identifier: Apache-2.0
#include "cloud/point_cloud.hpp"

namespace crane {

PointCloud to_points(const DepthFrame& f, double max_depth_m) {
  PointCloud cloud;
  const Eigen::Matrix3f R = f.T_map_rectified.linear().cast<float>();
  const Eigen::Vector3f t = f.T_map_rectified.translation().cast<float>();
  const auto inverse_f = static_cast<float>(1 / f.f_px);
  for (std::uint32_t v = 0; v < f.height; ++v)
    for (std::uint32_t u = 0; u < f.width; ++u) {
      const std::size_t i = std::size_t(v) * f.width + u;
      const float z = f.depth_m[i];
      if (!(z > 0) || z > static_cast<float>(max_depth_m)) continue;
      const Eigen::Vector3f p_rectified((float(u) - float(f.cx_px)) * inverse_f * z,
                                        (float(v) - float(f.cy_px)) * inverse_f * z, z);
      const Eigen::Vector3f p_map = R * p_rectified + t;
      Point point{p_map.x(), p_map.y(), p_map.z(), 128, 128, 128};
      if (f.colour != nullptr) {
        point.b = f.colour[3 * i];
        point.g = f.colour[3 * i + 1];
        point.r = f.colour[3 * i + 2];
      }
      cloud.push_back(point);
    }
  return cloud;
}

}  // namespace crane
