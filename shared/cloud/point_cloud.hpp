// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace crane {

struct Point {
  float x = 0, y = 0, z = 0;  ///< [m], frame said where it is used
  std::uint8_t r = 0, g = 0, b = 0;
};
using PointCloud = std::vector<Point>;

/// A pixel that was left out on purpose: what is known where it looks stays as it is.
inline constexpr float kNotLookedAt = std::numeric_limits<float>::quiet_NaN();

/// One frame's depth on the pixel grid of the rectified left camera. Borrows its pixels.
struct DepthFrame {
  std::uint32_t width = 0, height = 0;  ///< [px]
  double f_px = 0, cx_px = 0, cy_px = 0;
  /// sigma_z = z^2 / (f b) * sigma_disparity * 255 / confidence
  double baseline_m = 0, sigma_disparity_px = 0;
  /// Above 0: measured. Below 0: likely a surface at minus that depth, but no proof that the space
  /// before it is free. 0 = no match: no evidence. kNotLookedAt.
  const float* depth_m = nullptr;
  const std::uint8_t* confidence = nullptr;  ///< 0..255
  const std::uint8_t* colour = nullptr;      ///< BGR; nullptr = none
  Eigen::Isometry3d T_map_rectified = Eigen::Isometry3d::Identity();
};

/// Every pixel with depth as a point in the map frame (Zhao et al. 2021, eq. 5-7).
/// Points farther than max_depth_m along the view are left out. Cost O(width * height).
PointCloud to_points(const DepthFrame& frame, double max_depth_m);

}  // namespace crane
