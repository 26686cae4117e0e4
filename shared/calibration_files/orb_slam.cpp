// SPDX-License-Identifier: Apache-2.0
#include "calibration_files/document.hpp"
#include "calibration_files/formats.hpp"
#include "calibration_files/lens_numbers.hpp"
#include "calibration_files/number_text.hpp"

namespace crane {
namespace {

/// ORB-SLAM3: Camera1.fx and so on, for the type of camera that Camera.type names.
void read_camera3(DocumentReader& y, const std::string& camera, bool equidistant, CameraModel& c) {
  c.fx_px = y.number(camera + ".fx");
  c.fy_px = y.number(camera + ".fy");
  c.cx_px = y.number(camera + ".cx");
  c.cy_px = y.number(camera + ".cy");
  std::vector<double> d;
  if (equidistant) {
    for (const char* key : {".k1", ".k2", ".k3", ".k4"}) d.push_back(y.number(camera + key));
  } else if (y.has(camera + ".k1")) {
    for (const char* key : {".k1", ".k2", ".p1", ".p2"}) d.push_back(y.number(camera + key));
    if (y.has(camera + ".k3")) d.push_back(y.number(camera + ".k3"));
  }
  set_lens_numbers(equidistant ? LensModel::kEquidistant : LensModel::kRadialTangential, d, c);
}

void read_version3(DocumentReader& y, StereoRig& rig) {
  const std::string type = y.text("Camera.type");
  if (type != "PinHole" && type != "KannalaBrandt8")
    y.problem("Camera.type", "'" + type + "' is not PinHole or KannalaBrandt8 (raw images)");
  read_camera3(y, "Camera1", type == "KannalaBrandt8", rig.left);
  read_camera3(y, "Camera2", type == "KannalaBrandt8", rig.right);
  if (const auto T = y.matrix("Stereo.T_c1_c2", 4, 4); !T.empty())
    rig.T_left_right = transform_of(T);
}

void read_version2(DocumentReader& y, StereoRig& rig) {
  std::vector<double> R[2], P[2];
  for (const int side : {0, 1}) {
    const std::string name = side == 0 ? "LEFT" : "RIGHT";
    CameraModel& c = side == 0 ? rig.left : rig.right;
    const auto k = y.matrix(name + ".K", 3, 3);
    if (!k.empty() && !set_camera_matrix(k, c))
      y.problem(name + ".K", "is not [fx 0 cx, 0 fy cy, 0 0 1]");
    set_lens_numbers(LensModel::kRadialTangential, y.vector(name + ".D", {4, 5, 8}), c);
    R[side] = y.matrix(name + ".R", 3, 3);
    P[side] = y.matrix(name + ".P", 3, 4);
  }
  if (R[0].empty() || R[1].empty() || P[1].empty()) return;
  if (!(P[1][0] > 0)) return y.problem("RIGHT.P", "has no focal length");
  rig.T_left_right = relation_of(R[0], R[1], P[1][3] / P[1][0]);
}

}  // namespace

Result<StereoRig> read_orb_slam(const Texts& files) {
  auto root = yaml_document(files[0].text, files[0].name);
  if (!root) return root.error();
  DocumentReader y(*root, files[0].name);
  StereoRig rig;
  std::vector<double> size;
  if (y.has("LEFT.K")) {
    read_version2(y, rig);
    size = y.has("LEFT.width")
               ? std::vector<double>{y.number("LEFT.width"), y.number("LEFT.height")}
               : std::vector<double>{y.number("Camera.width"), y.number("Camera.height")};
  } else {
    read_version3(y, rig);
    size = {y.number("Camera.width"), y.number("Camera.height")};
  }
  if (!set_image_size(size, rig.left) || !set_image_size(size, rig.right))
    y.problem("Camera.width", "and Camera.height are not a size in pixels");
  if (auto done = y.finish(); !done) return done.error();
  return rig;
}

Result<Texts> write_orb_slam(const StereoRig& rig) {
  if (auto fits = refuse_lens(rig, "ORB-SLAM3", true, false, true); !fits) return fits.error();
  const bool equidistant = rig.left.lens == LensModel::kEquidistant;
  std::string s =
      "%YAML:1.0\n# The cameras; add Camera.fps, Camera.RGB, Stereo.ThDepth, ORBextractor.* and "
      "Viewer.* as your run wants them.\nFile.version: \"1.0\"\nCamera.type: \"" +
      std::string(equidistant ? "KannalaBrandt8" : "PinHole") +
      "\"\nCamera.width: " + std::to_string(rig.left.width) +
      "\nCamera.height: " + std::to_string(rig.left.height) + "\n";
  for (const bool right : {false, true}) {
    const CameraModel& c = right ? rig.right : rig.left;
    const std::string name = right ? "Camera2." : "Camera1.";
    const auto line = [&](const char* key, double value) {
      s += name + key + ": " + number_text(value) + "\n";
    };
    line("fx", c.fx_px);
    line("fy", c.fy_px);
    line("cx", c.cx_px);
    line("cy", c.cy_px);
    line("k1", c.k1);
    line("k2", c.k2);
    if (equidistant) {
      line("k3", c.k3);
      line("k4", c.k4);
    } else {
      line("p1", c.p1);
      line("p2", c.p2);
      if (c.k3 != 0) line("k3", c.k3);
    }
  }
  s += "# takes points of the right camera into the left one; ORB-SLAM3 wants it as floats\n"
       "Stereo.T_c1_c2: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n   data: [" +
       number_list(matrix_numbers(rig.T_left_right)) + "]\n";
  return Texts{{"orb_slam3.yaml", s}};
}

}  // namespace crane
