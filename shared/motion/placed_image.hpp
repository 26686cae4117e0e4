// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "base/clock.hpp"
#include "cloud/point_cloud.hpp"

namespace crane {

/// Brightness, rows from the top without padding.
struct Grey {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;

  [[nodiscard]] const std::uint8_t* row(int y) const {
    return pixels.data() + std::size_t(y) * std::size_t(width);
  }
};

/// A rectified left image and where it was taken.
struct PlacedImage {
  Grey full, half;  ///< half: of half the size, mean of 2 x 2
  Grey contrast;    ///< half without the mean of 33 x 33 around each pixel, and 128
  double f_px = 0, cx_px = 0, cy_px = 0;
  Eigen::Isometry3d T_map_rectified = Eigen::Isometry3d::Identity();
  TimeNs exposure = 0;
};

/// Of a placed frame with colour, which must have even sizes at least; odd ones lose a line.
/// On so many threads.
PlacedImage placed_image(const DepthFrame& frame, TimeNs exposure, int threads = 1);

/// How pixels of one placed image fall into another: a point at inverse depth w [1/m] along the ray
/// (x, y, 1) lies at R (x, y, 1) + w t in the other camera, up to scale.
struct Warp {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();  ///< [m]
};
/// `moved_m`: added to where `from` was taken, in the map.
Warp warp_between(const Eigen::Isometry3d& T_map_from, const Eigen::Isometry3d& T_map_to,
                  const Eigen::Vector2d& moved_m = Eigen::Vector2d::Zero());

}  // namespace crane
