// SPDX-License-Identifier: Apache-2.0
// What Stereolabs' own tools read and write: one section a camera and resolution, [STEREO] with the
// relation; newer files have the lens in [LEFT_DISTO] and [RIGHT_DISTO] for all resolutions. Their
// zed-opencv-calibration writes what cv::stereoCalibrate gives: x_right = R x_left + T,
// Baseline = -T.x, TY = T.y, TZ = T.z [mm], (RX, CV, RZ) the vector of R.
#include "calibration_files/document.hpp"
#include "calibration_files/formats.hpp"
#include "calibration_files/lens_numbers.hpp"
#include "calibration_files/number_text.hpp"

namespace crane {
namespace {

struct Resolution {
  const char* name;
  std::uint32_t width, height;
};
constexpr Resolution kResolutions[] = {
    {"2K", 2208, 1242}, {"FHD", 1920, 1080},     {"HD", 1280, 720},  {"VGA", 672, 376},
    {"4K", 3840, 2160}, {"FHD1200", 1920, 1200}, {"SVGA", 960, 600}, {"QHDPLUS", 3200, 1800},
};

/// The resolution of the asked size, or the only one that the file has.
Result<const Resolution*> resolution_of(const Node& root, const std::string& name,
                                        const AskedSize& size) {
  std::string there;
  const Resolution* found = nullptr;
  int count = 0;
  for (const Resolution& r : kResolutions) {
    if (root.find(std::string("LEFT_CAM_") + r.name) == nullptr) continue;
    there += (there.empty() ? "" : ", ") + std::to_string(r.width) + "x" + std::to_string(r.height);
    if (size.width == 0 || (size.width == r.width && size.height == r.height)) {
      found = &r;
      ++count;
    }
  }
  if (count == 1) return found;
  const auto bad = [&](const std::string& what, const std::string& todo) {
    return Error{ErrorCode::kConfiguration, name, what, todo};
  };
  if (there.empty())
    return bad("has no section [LEFT_CAM_...] of a resolution that is known",
               "give the SN*.conf of the camera as its maker has it");
  if (count > 1)
    return bad("holds several resolutions: " + there,
               "say which one the camera delivers: --size WIDTHxHEIGHT");
  return bad(
      "holds no calibration of " + std::to_string(size.width) + "x" + std::to_string(size.height),
      "it has: " + there);
}

void read_camera(DocumentReader& file, const std::string& side, const Resolution& r,
                 CameraModel& c) {
  DocumentReader y = file.section(side + "_CAM_" + r.name);
  c.width = r.width;
  c.height = r.height;
  c.fx_px = y.number("FX");
  c.fy_px = y.number("FY");
  c.cx_px = y.number("CX");
  c.cy_px = y.number("CY");
  const std::string disto = side + "_DISTO";
  DocumentReader lens = file.has(disto) ? file.section(disto) : y;
  const auto has = [&lens](const char* key) { return lens.has(key); };
  std::vector<double> d;
  // The maker's tool writes a fisheye as k1 to k4 and nothing else, every other lens with p1 and
  // p2.
  if (file.has(disto) && has("K4") && !has("P1") && !has("P2") && !has("K5") && !has("K6")) {
    for (const char* key : {"K1", "K2", "K3", "K4"}) d.push_back(lens.number(key));
    set_lens_numbers(LensModel::kEquidistant, d, c);
  } else {
    for (const char* key : {"K1", "K2", "P1", "P2", "K3"})
      // The oldest cameras have neither p1, p2 nor k3.
      d.push_back(
          std::string(key) == "K1" || std::string(key) == "K2" || has(key) ? lens.number(key) : 0);
    for (const char* key : {"K4", "K5", "K6"}) d.push_back(has(key) ? lens.number(key) : 0);
    set_lens_numbers(LensModel::kRadialTangential, d, c);
  }
  file.take_problems(y);
  if (file.has(disto)) file.take_problems(lens);
}

/// As KEY_RESOLUTION, or as KEY for all; an absent TY or TZ is 0 in old files.
double stereo_number(DocumentReader& y, const std::string& key, const Resolution& r,
                     bool optional) {
  const std::string full = key + "_" + r.name;
  if (y.has(full)) return y.number(full);
  if (y.has(key)) return y.number(key);
  if (!optional) y.problem(full, "is missing");
  return 0;
}

}  // namespace

Result<StereoRig> read_zed(const Texts& files, const AskedSize& size) {
  const std::string& name = files[0].name;
  auto root = ini_document(files[0].text, name);
  if (!root) return root.error();
  const auto chosen = resolution_of(*root, name, size);
  if (!chosen) return chosen.error();
  const Resolution& r = *chosen.value();
  DocumentReader file(*root, name);
  StereoRig rig;
  read_camera(file, "LEFT", r, rig.left);
  read_camera(file, "RIGHT", r, rig.right);
  DocumentReader stereo = file.section("STEREO");
  const Eigen::Vector3d turn(stereo_number(stereo, "RX", r, false),
                             stereo_number(stereo, stereo.has("RY") ? "RY" : "CV", r, false),
                             stereo_number(stereo, "RZ", r, false));
  const Eigen::Vector3d shift_mm(-stereo_number(stereo, "BASELINE", r, false),
                                 stereo_number(stereo, "TY", r, true),
                                 stereo_number(stereo, "TZ", r, true));
  file.take_problems(stereo);
  if (auto done = file.finish(); !done) return done.error();
  Eigen::Isometry3d T_right_left = Eigen::Isometry3d::Identity();
  if (turn.norm() > 0)
    T_right_left.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  T_right_left.translation() = 1e-3 * shift_mm;
  rig.T_left_right = T_right_left.inverse();
  return rig;
}

Result<Texts> write_zed(const StereoRig& rig) {
  if (auto fits = refuse_lens(rig, "ZED's SN*.conf", true, true, true); !fits) return fits.error();
  const Resolution* found = nullptr;
  for (const Resolution& r : kResolutions)
    if (r.width == rig.left.width && r.height == rig.left.height) found = &r;
  if (found == nullptr)
    return Error{ErrorCode::kConfiguration, "ZED's SN*.conf",
                 "has no name for images of " + std::to_string(rig.left.width) + " x " +
                     std::to_string(rig.left.height),
                 "take another format"};
  const std::string name = found->name;
  std::string s;
  const auto line = [&s](const std::string& key, double value) {
    s += key + "=" + number_text(value) + "\n";
  };
  const auto of_lens = [&rig](LensModel lens) {
    return rig.left.lens == lens || rig.right.lens == lens;
  };
  const bool disto = of_lens(LensModel::kRational) || of_lens(LensModel::kEquidistant);
  for (const bool right : {false, true}) {
    const CameraModel& c = right ? rig.right : rig.left;
    s += std::string(right ? "[RIGHT" : "[LEFT") + "_CAM_" + name + "]\n";
    line("fx", c.fx_px);
    line("fy", c.fy_px);
    line("cx", c.cx_px);
    line("cy", c.cy_px);
    if (disto) s += std::string(right ? "[RIGHT" : "[LEFT") + "_DISTO]\n";
    auto d = lens_numbers(c);
    if (c.lens == LensModel::kEquidistant) {
      static constexpr const char* kFisheye[] = {"k1", "k2", "k3", "k4"};
      for (std::size_t i = 0; i < d.size(); ++i) line(kFisheye[i], d[i]);
    } else {
      d.resize(disto ? 8 : 5);
      static constexpr const char* kKeys[] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
      for (std::size_t i = 0; i < d.size(); ++i) line(kKeys[i], d[i]);
    }
    s += "\n";
  }
  const Eigen::Isometry3d T = rig.T_right_left();
  const Eigen::AngleAxisd turn(T.linear());
  const Eigen::Vector3d vector = turn.angle() * turn.axis();
  s += "[STEREO]\n";
  line("Baseline", -1e3 * T.translation().x());
  line("TY", 1e3 * T.translation().y());
  line("TZ", 1e3 * T.translation().z());
  line("CV_" + name, vector.y());
  line("RX_" + name, vector.x());
  line("RZ_" + name, vector.z());
  return Texts{{"SN0.conf", s}};
}

}  // namespace crane
