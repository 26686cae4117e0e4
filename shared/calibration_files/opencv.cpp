// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>

#include "calibration_files/document.hpp"
#include "calibration_files/formats.hpp"
#include "calibration_files/lens_numbers.hpp"
#include "calibration_files/number_text.hpp"

namespace crane {
namespace {

std::string matrix_text(bool xml, const std::string& name, int rows, int columns,
                        const std::vector<double>& values) {
  const std::string r = std::to_string(rows);
  const std::string c = std::to_string(columns);
  if (!xml)
    return name + ": !!opencv-matrix\n   rows: " + r + "\n   cols: " + c +
           "\n   dt: d\n   data: [ " + number_list(values) + " ]\n";
  std::string data;
  for (const double v : values) data += " " + number_text(v);
  return "<" + name + " type_id=\"opencv-matrix\">\n  <rows>" + r + "</rows>\n  <cols>" + c +
         "</cols>\n  <dt>d</dt>\n  <data>" + data + "</data></" + name + ">\n";
}

std::string whole_text(bool xml, const std::string& text) {
  return xml ? "<?xml version=\"1.0\"?>\n<opencv_storage>\n" + text + "</opencv_storage>\n"
             : "%YAML:1.0\n---\n" + text;
}

std::string whole_number(bool xml, const std::string& name, std::uint32_t value) {
  const std::string v = std::to_string(value);
  return xml ? "<" + name + ">" + v + "</" + name + ">\n" : name + ": " + v + "\n";
}

void read_camera(DocumentReader& y, const std::string& number, CameraModel& c) {
  const auto k = y.matrix("M" + number, 3, 3);
  if (!k.empty() && !set_camera_matrix(k, c))
    y.problem("M" + number, "is not [fx 0 cx, 0 fy cy, 0 0 1]");
  const auto d = y.vector("D" + number, {4, 5, 8, 12, 14});
  for (std::size_t i = 8; i < d.size(); ++i)
    if (d[i] != 0) {
      y.problem("D" + number, "has a thin prism or a tilted sensor (number " +
                                  std::to_string(i + 1) + " is not 0): calibrate without");
      break;
    }
  set_lens_numbers(LensModel::kRadialTangential, d, c);
}

}  // namespace

Result<StereoRig> read_opencv(const Texts& files, const AskedSize& size) {
  Node all;
  std::string names;
  for (const NamedText& file : files) {
    const bool xml = file.text.find_first_not_of(" \t\r\n") == file.text.find('<');
    auto root = xml ? xml_document(file.text, file.name) : yaml_document(file.text, file.name);
    if (!root) return root.error();
    for (auto& field : root->fields)
      if (all.find(field.first) == nullptr) all.fields.push_back(std::move(field));
    names += (names.empty() ? "" : " + ") + file.name;
  }
  DocumentReader y(all, names);
  StereoRig rig;
  read_camera(y, "1", rig.left);
  read_camera(y, "2", rig.right);
  const auto R = y.matrix("R", 3, 3);
  const auto t = y.vector("T", {3});
  std::vector<double> pixels = {double(size.width), double(size.height)};
  if (size.width == 0 && !y.has("image_width"))
    y.problem("image_width",
              "is missing, as it is in the files of OpenCV's sample: tell the size "
              "of the images with --size");
  else if (size.width == 0)
    pixels = {y.number("image_width"), y.number("image_height")};
  if (!set_image_size(pixels, rig.left) || !set_image_size(pixels, rig.right))
    y.problem("image_width", "and image_height are not a size in pixels");
  if (auto done = y.finish(); !done) return done.error();
  Eigen::Isometry3d T_right_left = Eigen::Isometry3d::Identity();
  T_right_left.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data());
  T_right_left.translation() = Eigen::Map<const Eigen::Vector3d>(t.data());
  rig.T_left_right = T_right_left.inverse();
  return rig;
}

Result<Texts> write_opencv(const StereoRig& rig, bool xml) {
  if (auto fits = refuse_lens(rig, "OpenCV's stereo_calib", true, true, false); !fits)
    return fits.error();
  const auto rectified = rectification_of(rig, "OpenCV's stereo_calib");
  if (!rectified) return rectified.error();
  std::string inner = whole_number(xml, "image_width", rig.left.width) +
                      whole_number(xml, "image_height", rig.left.height);
  for (const bool right : {false, true}) {
    const std::string number = right ? "2" : "1";
    const CameraModel& c = right ? rig.right : rig.left;
    const auto d = lens_numbers(c);
    inner += matrix_text(xml, "M" + number, 3, 3, camera_matrix(c)) +
             matrix_text(xml, "D" + number, 1, int(d.size()), d);
  }
  const auto T = matrix_numbers(rig.T_right_left());
  std::string outer =
      matrix_text(xml, "R", 3, 3, {T[0], T[1], T[2], T[4], T[5], T[6], T[8], T[9], T[10]}) +
      matrix_text(xml, "T", 3, 1, {T[3], T[7], T[11]});
  for (const int side : {0, 1})
    outer += matrix_text(xml, "R" + std::to_string(side + 1), 3, 3, rectified->R[side]) +
             matrix_text(xml, "P" + std::to_string(side + 1), 3, 4, rectified->P[side]);
  const std::string end = xml ? ".xml" : ".yml";
  return Texts{{"intrinsics" + end, whole_text(xml, inner)},
               {"extrinsics" + end, whole_text(xml, outer)}};
}

}  // namespace crane
