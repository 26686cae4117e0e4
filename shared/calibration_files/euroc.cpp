// SPDX-License-Identifier: Apache-2.0
#include "calibration_files/formats.hpp"
#include "calibration_files/lens_numbers.hpp"
#include "calibration_files/number_text.hpp"
#include "recording/calibration.hpp"

namespace crane {

Result<StereoRig> read_euroc(const Texts& files) {
  const auto left = parse_camera(files[0].text, files[0].name);
  if (!left) return left.error();
  const auto right = parse_camera(files[1].text, files[1].name);
  if (!right) return right.error();
  StereoRig rig;
  rig.left = left->model;
  rig.right = right->model;
  rig.T_left_right = left->T_body_camera.inverse() * right->T_body_camera;
  return rig;
}

Result<Texts> write_euroc(const StereoRig& rig) {
  if (auto fits = refuse_lens(rig, "EuRoC", false, false, false); !fits) return fits.error();
  Texts out;
  for (const bool right : {false, true}) {
    const CameraModel& c = right ? rig.right : rig.left;
    const Eigen::Isometry3d T = right ? rig.T_left_right : Eigen::Isometry3d::Identity();
    out.push_back({right ? "cam1/sensor.yaml" : "cam0/sensor.yaml",
                   "# body = the axes of cam0: x right, y down, z along the view; metres\n"
                   "sensor_type: camera\ncomment: " +
                       std::string(right ? "right" : "left") +
                       "\nT_BS:\n  cols: 4\n  rows: 4\n  data: [" + number_list(matrix_numbers(T)) +
                       "]\nrate_hz: 10\nresolution: [" + std::to_string(c.width) + ", " +
                       std::to_string(c.height) + "]\ncamera_model: pinhole\nintrinsics: [" +
                       number_list({c.fx_px, c.fy_px, c.cx_px, c.cy_px}) +
                       "]\ndistortion_model: radial-tangential\ndistortion_coefficients: [" +
                       number_list({c.k1, c.k2, c.p1, c.p2}) + "]\n"});
  }
  return out;
}

}  // namespace crane
