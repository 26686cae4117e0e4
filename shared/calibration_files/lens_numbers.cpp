// SPDX-License-Identifier: Apache-2.0
#include "calibration_files/lens_numbers.hpp"

#include <cmath>

namespace crane {

void set_lens_numbers(LensModel model, const std::vector<double>& numbers, CameraModel& c) {
  std::vector<double> d = numbers;
  d.resize(8);
  c.k1 = d[0];
  c.k2 = d[1];
  if (model == LensModel::kEquidistant) {
    c.lens = model;
    c.k3 = d[2];
    c.k4 = d[3];
    return;
  }
  c.p1 = d[2];
  c.p2 = d[3];
  c.k3 = d[4];
  c.k4 = d[5];
  c.k5 = d[6];
  c.k6 = d[7];
  const bool rational = c.k4 != 0 || c.k5 != 0 || c.k6 != 0 || model == LensModel::kRational;
  c.lens = rational ? LensModel::kRational : LensModel::kRadialTangential;
}

std::vector<double> lens_numbers(const CameraModel& c) {
  if (c.lens == LensModel::kEquidistant) return {c.k1, c.k2, c.k3, c.k4};
  std::vector<double> d = {c.k1, c.k2, c.p1, c.p2, c.k3};
  if (c.lens == LensModel::kRational) d.insert(d.end(), {c.k4, c.k5, c.k6});
  return d;
}

std::vector<double> camera_matrix(const CameraModel& c) {
  return {c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1};
}

bool set_camera_matrix(const std::vector<double>& k, CameraModel& c) {
  c.fx_px = k[0];
  c.cx_px = k[2];
  c.fy_px = k[4];
  c.cy_px = k[5];
  return k[1] == 0 && k[3] == 0 && k[6] == 0 && k[7] == 0 && k[8] == 1;
}

bool set_image_size(const std::vector<double>& size, CameraModel& c) {
  if (size.size() != 2) return false;
  for (const double s : size)
    if (!(s >= 16 && s <= 65'535) || s != std::floor(s)) return false;
  c.width = static_cast<std::uint32_t>(size[0]);
  c.height = static_cast<std::uint32_t>(size[1]);
  return true;
}

std::vector<double> matrix_numbers(const Eigen::Isometry3d& T) {
  std::vector<double> out;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) out.push_back(T.matrix()(r, c));
  return out;
}

Eigen::Isometry3d transform_of(const std::vector<double>& numbers) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) T.matrix()(r, c) = numbers[static_cast<std::size_t>(r * 4 + c)];
  return T;
}

Result<void> refuse_lens(const StereoRig& rig, const std::string& format, bool k3, bool rational,
                         bool equidistant) {
  for (const CameraModel* c : {&rig.left, &rig.right}) {
    std::string what;
    if (c->lens == LensModel::kRational && !rational) what = "a rational lens (k4, k5, k6)";
    if (c->lens == LensModel::kEquidistant && !equidistant) what = "an equidistant lens";
    if (c->lens == LensModel::kRadialTangential && c->k3 != 0 && !k3) what = "a lens with k3";
    if (!what.empty())
      return Error{ErrorCode::kConfiguration, c == &rig.left ? "cam0" : "cam1",
                   "has " + what + ", and " + format + " has no place for it",
                   "calibrate with a lens model that it has, or take another format; left out it "
                   "would be another camera"};
  }
  return {};
}

}  // namespace crane
