// SPDX-License-Identifier: Apache-2.0
#include "recording/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <locale>
#include <sstream>

#include "base/read_file.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

/// Numbers with a decimal point and without separators, whatever the program's locale.
std::ostringstream number_stream() {
  std::ostringstream s;
  s.imbue(std::locale::classic());
  s.precision(17);
  return s;
}

/// 4 x 4 row by row under `key: {data: [...]}`.
void read_transform(YamlReader& y, const std::string& key, Eigen::Isometry3d& out) {
  YamlReader t = y.section(key, true);
  std::vector<double> m;
  t.ignore("rows");
  t.ignore("cols");
  t.numbers("data", m, 16, true);
  if (m.empty()) return;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) out.matrix()(r, c) = m[static_cast<std::size_t>(r * 4 + c)];
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
    t.problem("data", "does not end with the row 0, 0, 0, 1");
}

struct LensName {
  const char* name;
  LensModel model;
  std::size_t coefficients;
};
/// Ours first; then as EuRoC, ROS, Kalibr and OpenCV call the same model.
constexpr LensName kLensNames[] = {
    {"radial-tangential", LensModel::kRadialTangential, 5},
    {"plumb_bob", LensModel::kRadialTangential, 5},
    {"radtan", LensModel::kRadialTangential, 5},
    {"rational", LensModel::kRational, 8},
    {"rational_polynomial", LensModel::kRational, 8},
    {"equidistant", LensModel::kEquidistant, 4},
    {"fisheye", LensModel::kEquidistant, 4},
};

const LensName* lens_named(const std::string& name) {
  for (const LensName& lens : kLensNames)
    if (name == lens.name) return &lens;
  return nullptr;
}

/// Coefficients in OpenCV's order; those that are not there are 0.
void set_lens(LensModel model, std::vector<double> d, CameraModel& c) {
  d.resize(std::max<std::size_t>(d.size(), 8));
  c.lens = model;
  c.k1 = d[0];
  c.k2 = d[1];
  if (model == LensModel::kEquidistant) {
    c.k3 = d[2];
    c.k4 = d[3];
    return;
  }
  c.p1 = d[2];
  c.p2 = d[3];
  c.k3 = d[4];
  if (model == LensModel::kRational) c.k4 = d[5], c.k5 = d[6], c.k6 = d[7];
}

std::vector<double> coefficients_of(const CameraModel& c) {
  if (c.lens == LensModel::kEquidistant) return {c.k1, c.k2, c.k3, c.k4};
  std::vector<double> d = {c.k1, c.k2, c.p1, c.p2};
  if (c.lens == LensModel::kRational || c.k3 != 0) d.push_back(c.k3);
  if (c.lens == LensModel::kRational) d.insert(d.end(), {c.k4, c.k5, c.k6});
  return d;
}

std::string lens_text(const CameraModel& c) {
  std::ostringstream s = number_stream();
  for (const LensName& lens : kLensNames)
    if (lens.model == c.lens) {
      s << "distortion_model: " << lens.name << "\ndistortion_coefficients: [";
      break;
    }
  const std::vector<double> d = coefficients_of(c);
  for (std::size_t i = 0; i < d.size(); ++i) s << (i > 0 ? ", " : "") << d[i];
  s << "]\n";
  return s.str();
}

Result<CameraInBody> read_camera(YamlReader y) {
  for (const char* key : {"comment", "rate_hz"}) y.ignore(key);
  std::string type = "camera";
  std::string model = "pinhole";
  std::string distortion = "radial-tangential";
  y.text("sensor_type", type);
  if (type != "camera") y.problem("sensor_type", "is not 'camera'");
  y.text("camera_model", model);
  if (model != "pinhole") y.problem("camera_model", "is not 'pinhole'");
  y.text("distortion_model", distortion);
  const LensName* lens = lens_named(distortion);
  if (lens == nullptr)
    y.problem("distortion_model",
              "'" + distortion + "' is not 'radial-tangential' (also: plumb_bob, radtan), " +
                  "'rational' (rational_polynomial) or 'equidistant' (fisheye)");
  std::vector<double> size;
  std::vector<double> k;
  std::vector<double> d = {0, 0, 0, 0};
  y.numbers("resolution", size, 2, true);
  y.numbers("intrinsics", k, 4, true);
  y.numbers("distortion_coefficients", d, 4, 14, false);
  if (lens != nullptr && lens->model == LensModel::kRational && d.size() < lens->coefficients)
    y.problem("distortion_coefficients", "are fewer than the 8 of '" + distortion + "'");
  // OpenCV writes up to 14 (thin prism, tilt); calibrated without them they are 0.
  const std::size_t used = lens == nullptr ? d.size() : lens->coefficients;
  for (std::size_t i = used; i < d.size(); ++i)
    if (d[i] != 0) {
      y.problem("distortion_coefficients",
                "number " + std::to_string(i + 1) + " is not 0: '" + distortion + "' has " +
                    std::to_string(used) +
                    (used < 8 ? "; of 8 the distortion_model is rational" : ""));
      break;
    }
  int bits = 0;
  y.integer("bits", bits, 8, 16);
  CameraInBody out;
  read_transform(y, "T_BS", out.T_body_camera);
  for (const double s : size)
    if (s < 16 || s > 65'535 || s != std::floor(s))
      y.problem("resolution", "is not a size in pixels");
  if (auto done = y.finish(); !done) return done.error();
  out.model = {static_cast<std::uint32_t>(size[0]),
               static_cast<std::uint32_t>(size[1]),
               k[0],
               k[1],
               k[2],
               k[3],
               d[0],
               d[1],
               0,
               0,
               bits};
  if (lens != nullptr) set_lens(lens->model, d, out.model);
  return out;
}

std::string transform_text(const Eigen::Isometry3d& T) {
  std::ostringstream s = number_stream();
  s << "\n  cols: 4\n  rows: 4\n  data: [";
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) s << (r + c > 0 ? ", " : "") << T.matrix()(r, c);
  s << "]\n";
  return s.str();
}

Result<void> write_text(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file)
    return Error{ErrorCode::kResource, path, "cannot be written",
                 "check permissions and free space"};
  return {};
}

}  // namespace

Result<StereoRig> read_rig(const std::string& folder) {
  StereoRig rig;
  const auto there = is_folder(folder);
  if (!there) return there.error();
  if (!*there)
    return Error{ErrorCode::kConfiguration, folder, "no such folder",
                 "give the folder that holds cam0, cam1 and rig.yaml"};
  // T_BS: camera in a body frame of the calibration's choice (EuRoC: that of the IMU). rig.yaml
  // places cam0 itself, so that only what the cameras are to each other counts of it.
  Eigen::Isometry3d T_body[2] = {Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()};
  for (int i = 0; i < 2; ++i) {
    const std::string path = folder + "/cam" + std::to_string(i) + "/sensor.yaml";
    auto file = YamlReader::from_file(path);
    if (!file) return file.error();
    auto camera = read_camera(std::move(*file));
    if (!camera) return camera.error();
    (i == 0 ? rig.left : rig.right) = camera->model;
    T_body[i] = camera->T_body_camera;
    if (auto r = check_rotation(T_body[i].linear(), path, "T_BS"); !r) return r.error();
  }
  rig.T_left_right = T_body[0].inverse() * T_body[1];
  auto file = YamlReader::from_file(folder + "/rig.yaml");
  if (!file) return file.error();
  file->ignore("comment");
  read_transform(*file, "T_world_cam0", rig.T_map_camera_at_zero);
  if (auto done = file->finish(); !done) return done.error();
  if (auto usable = check_rig(rig, folder); !usable) return usable.error();
  return rig;
}

Result<CameraInBody> parse_camera(const std::string& text, const std::string& name) {
  auto file = YamlReader::from_text(text, name);
  if (!file) return file.error();
  return read_camera(std::move(*file));
}

Result<void> write_rig(const StereoRig& rig, const std::string& folder, double rate_hz) {
  std::error_code failed;
  for (int i = 0; i < 2; ++i) {
    const CameraModel& c = i == 0 ? rig.left : rig.right;
    const std::string dir = folder + "/cam" + std::to_string(i);
    std::filesystem::create_directories(dir + "/data", failed);
    std::ostringstream s = number_stream();
    const std::string bits = c.bits > 0 ? "bits: " + std::to_string(c.bits) + "\n" : "";
    s << "# camera axes: x right, y down in the image, z along the view; body = the axes of cam0\n"
      << "sensor_type: camera\ncomment: " << (i == 0 ? "left" : "right")
      << "\nT_BS:" << transform_text(i == 0 ? Eigen::Isometry3d::Identity() : rig.T_left_right)
      << "rate_hz: " << rate_hz << "\nresolution: [" << c.width << ", " << c.height
      << "]\ncamera_model: pinhole\n"
      << "intrinsics: [" << c.fx_px << ", " << c.fy_px << ", " << c.cx_px << ", " << c.cy_px
      << "] # fu, fv, cu, cv\n"
      << lens_text(c) << bits;
    if (auto r = write_text(dir + "/sensor.yaml", s.str()); !r) return r;
  }
  return write_text(folder + "/rig.yaml",
                    "# map: x along the runway (cart), y along the bridge (trolley), z up, floor "
                    "at z = 0; metres\n# p_map = T_world_cam0 * p_cam0 + [cart, trolley, 0]\n"
                    "T_world_cam0:" +
                        transform_text(rig.T_map_camera_at_zero));
}

Result<RangefinderModel> read_rangefinder(const std::string& path) {
  auto y = YamlReader::from_file(path);
  if (!y) return y.error();
  RangefinderModel model;
  std::string type;
  y->ignore("comment");
  y->text("sensor_type", type, true);
  if (!type.empty() && type != "rangefinder") y->problem("sensor_type", "is not 'rangefinder'");
  y->number("accuracy_m", model.accuracy_m, 0, 10);
  y->number("range_m", model.range_m, 0.1, 10'000);
  y->number("rate_hz", model.rate_hz, 0.001, 10'000);
  if (auto done = y->finish(); !done) return done.error();
  return model;
}

Result<void> write_rangefinder(const std::string& path, const RangefinderModel& model) {
  std::ostringstream s = number_stream();
  s.precision(6);
  s << "sensor_type: rangefinder\naccuracy_m: " << model.accuracy_m
    << "\nrange_m: " << model.range_m << "\nrate_hz: " << model.rate_hz << "\n";
  return write_text(path, s.str());
}

}  // namespace crane
