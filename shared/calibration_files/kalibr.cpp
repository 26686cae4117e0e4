// SPDX-License-Identifier: Apache-2.0
#include <optional>

#include "calibration_files/document.hpp"
#include "calibration_files/formats.hpp"
#include "calibration_files/lens_numbers.hpp"
#include "calibration_files/number_text.hpp"

namespace crane {
namespace {

void read_camera(DocumentReader& y, CameraModel& c) {
  if (const std::string model = y.text("camera_model"); model != "pinhole")
    y.problem("camera_model", "is '" + model + "': calibrate with Kalibr's model pinhole");
  const auto k = y.numbers("intrinsics", 4, 4);
  const auto size = y.numbers("resolution", 2, 2);
  const std::string lens = y.text("distortion_model");
  if (lens != "radtan" && lens != "equidistant" && lens != "none")
    y.problem("distortion_model", "'" + lens + "' is not radtan, equidistant or none");
  const auto d = lens == "none" ? std::vector<double>(4) : y.numbers("distortion_coeffs", 4, 4);
  if (k.empty() || size.empty() || d.empty()) return;
  c.fx_px = k[0];
  c.fy_px = k[1];
  c.cx_px = k[2];
  c.cy_px = k[3];
  if (!set_image_size(size, c)) y.problem("resolution", "is not a size in pixels");
  set_lens_numbers(lens == "equidistant" ? LensModel::kEquidistant : LensModel::kRadialTangential,
                   d, c);
}

}  // namespace

Result<StereoRig> read_kalibr(const Texts& files) {
  auto root = yaml_document(files[0].text, files[0].name);
  if (!root) return root.error();
  DocumentReader y(*root, files[0].name);
  StereoRig rig;
  std::optional<Eigen::Isometry3d> T_imu_camera[2];
  if (y.has("cam2")) y.problem("cam2", "is a third camera: leave cam0 and cam1 in the file");
  for (const bool right : {false, true}) {
    DocumentReader camera = y.section(right ? "cam1" : "cam0");
    read_camera(camera, right ? rig.right : rig.left);
    // Chains of cameras and an IMU may place each camera in it instead; open_vins turns that round.
    for (const auto& [key, inverse] : {std::pair{"T_cam_imu", true}, std::pair{"T_imu_cam", false}})
      if (camera.has(key))
        if (const auto T = camera.matrix(key, 4, 4); !T.empty())
          T_imu_camera[right ? 1 : 0] = inverse ? transform_of(T).inverse() : transform_of(T);
    if (right && (camera.has("T_cn_cnm1") || !T_imu_camera[0] || !T_imu_camera[1])) {
      if (const auto T = camera.matrix("T_cn_cnm1", 4, 4); !T.empty())
        rig.T_left_right = transform_of(T).inverse();
    } else if (right) {
      rig.T_left_right = T_imu_camera[0]->inverse() * *T_imu_camera[1];
    }
    y.take_problems(camera);
  }
  if (auto done = y.finish(); !done) return done.error();
  return rig;
}

Result<Texts> write_kalibr(const StereoRig& rig) {
  if (auto fits = refuse_lens(rig, "Kalibr", false, false, true); !fits) return fits.error();
  std::string s = "# T_cn_cnm1 takes points of cam0 (left) into cam1 (right); metres\n";
  for (const bool right : {false, true}) {
    const CameraModel& c = right ? rig.right : rig.left;
    std::vector<double> d = lens_numbers(c);
    d.resize(4);
    s += right ? "cam1:\n" : "cam0:\n";
    s += "  camera_model: pinhole\n  intrinsics: [" +
         number_list({c.fx_px, c.fy_px, c.cx_px, c.cy_px}) + "]\n  distortion_model: " +
         (c.lens == LensModel::kEquidistant ? "equidistant" : "radtan") +
         "\n  distortion_coeffs: [" + number_list(d) + "]\n  resolution: [" +
         std::to_string(c.width) + ", " + std::to_string(c.height) + "]\n  cam_overlaps: [" +
         (right ? "0" : "1") + "]\n  rostopic: " + (right ? "/right" : "/left") + "/image_raw\n";
    if (!right) continue;
    s += "  T_cn_cnm1:\n";
    const auto T = matrix_numbers(rig.T_right_left());
    for (auto row = T.begin(); row != T.end(); row += 4)
      s += "  - [" + number_list({row, row + 4}) + "]\n";
  }
  return Texts{{"camchain.yaml", s}};
}

}  // namespace crane
