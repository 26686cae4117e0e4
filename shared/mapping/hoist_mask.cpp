// SPDX-License-Identifier: Apache-2.0
#include "mapping/hoist_mask.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/convex_polygon.hpp"

namespace crane {
namespace {

constexpr double kNear = 0.05;  ///< [m] before the camera
constexpr double kFar = 1e6;    ///< [px]

/// Where the part of a convex body before the camera falls in the image: a line between any two of
/// its corners lies in it, so that those cut off at the near plane have all corners of the cut.
std::vector<Corner> outline(const std::vector<Eigen::Vector3d>& body, const DepthFrame& f) {
  const Eigen::Isometry3d T_camera_map = f.T_map_rectified.inverse();
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector3d& p : body) corners.emplace_back(T_camera_map * p);
  std::vector<Corner> out;
  const auto project = [&](const Eigen::Vector3d& p) {
    const auto pixel = [&](double offset, double centre) {
      return std::clamp(offset / p.z() * f.f_px + centre, -kFar, kFar);
    };
    out.push_back({pixel(p.x(), f.cx_px + 0.5), pixel(p.y(), f.cy_px + 0.5)});
  };
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i].z() >= kNear) project(corners[i]);
    for (std::size_t k = 0; k < i; ++k) {
      const Eigen::Vector3d& a = corners[i];
      const Eigen::Vector3d& b = corners[k];
      if ((a.z() >= kNear) == (b.z() >= kNear)) continue;
      project(a + (b - a) * ((kNear - a.z()) / (b.z() - a.z())));
    }
  }
  return convex_hull(std::move(out));
}

}  // namespace

std::size_t mask_bodies(const Bodies& bodies, const DepthFrame& frame, std::span<float> depth_m) {
  std::size_t masked = 0;
  for (const auto& body : bodies) {
    const std::vector<Corner> hull = outline(body, frame);
    if (hull.empty()) continue;
    const int width = static_cast<int>(frame.width);
    for (const PolygonRow& row : rows_of(hull, 1)) {
      if (row.row < 0 || row.row >= static_cast<int>(frame.height)) continue;
      for (int u = std::max(row.first, 0); u <= std::min(row.last, width - 1); ++u) {
        float& depth = depth_m[std::size_t(row.row) * frame.width + std::size_t(u)];
        masked += depth != 0 && !std::isnan(depth) ? 1 : 0;
        depth = kNotLookedAt;
      }
    }
  }
  return masked;
}

}  // namespace crane
