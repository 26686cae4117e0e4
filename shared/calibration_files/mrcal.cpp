// SPDX-License-Identifier: Apache-2.0
#include "calibration_files/document.hpp"
#include "calibration_files/formats.hpp"
#include "calibration_files/lens_numbers.hpp"

namespace crane {
namespace {

/// Reads one camera and where it is: T_camera_reference.
Result<Eigen::Isometry3d> read_model(const NamedText& file, CameraModel& c) {
  auto root = python_document(file.text, file.name);
  if (!root) return root.error();
  DocumentReader y(*root, file.name);
  // Older files name it otherwise.
  const std::string model = y.text(y.has("lens_model") ? "lens_model" : "lensmodel");
  std::size_t coefficients = 0;
  if (model == "LENSMODEL_OPENCV4") coefficients = 4;
  if (model == "LENSMODEL_OPENCV5") coefficients = 5;
  if (model == "LENSMODEL_OPENCV8") coefficients = 8;
  if (coefficients == 0 && model != "LENSMODEL_PINHOLE")
    y.problem("lensmodel", "'" + model +
                               "' has no counterpart here: mrcal-convert-lensmodel "
                               "LENSMODEL_OPENCV8 makes one");
  const auto k = y.numbers("intrinsics", 4 + coefficients, 4 + coefficients);
  if (!set_image_size(y.numbers("imagersize", 2, 2), c))
    y.problem("imagersize", "is not a size in pixels");
  const auto place = y.numbers(y.has("rt_cam_ref") ? "rt_cam_ref" : "extrinsics", 6, 6);
  if (auto done = y.finish(); !done) return done.error();
  c.fx_px = k[0];
  c.fy_px = k[1];
  c.cx_px = k[2];
  c.cy_px = k[3];
  set_lens_numbers(LensModel::kRadialTangential, {k.begin() + 4, k.end()}, c);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d turn(place[0], place[1], place[2]);
  if (turn.norm() > 0)
    T.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  T.translation() = Eigen::Vector3d(place[3], place[4], place[5]);
  return T;
}

}  // namespace

Result<StereoRig> read_mrcal(const Texts& files) {
  StereoRig rig;
  const auto left = read_model(files[0], rig.left);
  if (!left) return left.error();
  const auto right = read_model(files[1], rig.right);
  if (!right) return right.error();
  rig.T_left_right = left.value() * right.value().inverse();
  return rig;
}

}  // namespace crane
