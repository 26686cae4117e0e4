// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/cloud_check.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

/// A depth of confidence 0 is one of several that fit: no evidence until motion tells which.
void take_out_ambiguous(CloudSample& cloud) {
  cloud.ambiguous_m.clear();
  for (std::size_t i = 0; i < cloud.depth_m.size(); ++i) {
    if (cloud.confidence[i] != 0 || cloud.depth_m[i] == 0) continue;
    if (cloud.ambiguous_m.empty()) cloud.ambiguous_m.resize(cloud.depth_m.size());
    cloud.ambiguous_m[i] = std::max(0.F, cloud.depth_m[i]);
    cloud.depth_m[i] = 0;
  }
}

}  // namespace

std::optional<Cause> check_cloud(CloudSample& cloud, std::uint64_t calibration) {
  if (cloud.calibration != calibration) return Cause::kCloudOtherCalibration;
  const DepthFrame& f = cloud.frame;
  const std::size_t pixels = std::size_t(f.width) * f.height;
  if (pixels == 0 || cloud.depth_m.size() != pixels || cloud.confidence.size() != pixels ||
      (!cloud.colour.empty() && cloud.colour.size() != 3 * pixels))
    return Cause::kCloudMisfit;
  // The optical axis can lie beside the image after rectification, but not far away from it.
  const auto near_image = [](double c, std::uint32_t size) {
    return c > -double(size) && c < 2. * size;
  };
  if (!(f.f_px > 1 && f.f_px < 1e6 && f.baseline_m > 0 && f.baseline_m < 100 &&
        f.sigma_disparity_px > 0 && f.sigma_disparity_px < 100) ||
      !near_image(f.cx_px, f.width) || !near_image(f.cy_px, f.height))
    return Cause::kCloudMisfit;
  const Eigen::Matrix3d& R = cloud.R_camera_rectified;
  if (!((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3 && R.determinant() > 0))
    return Cause::kCloudMisfit;
  // At a disparity of an eighth of a pixel nothing is measured any more.
  const auto farthest = static_cast<float>(8 * f.f_px * f.baseline_m);
  for (float& depth : cloud.depth_m) depth = std::abs(depth) <= farthest ? depth : 0.F;
  take_out_ambiguous(cloud);
  return std::nullopt;
}

}  // namespace crane
