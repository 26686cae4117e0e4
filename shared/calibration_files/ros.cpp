// SPDX-License-Identifier: Apache-2.0
#include <opencv2/calib3d.hpp>

#include "calibration_files/document.hpp"
#include "calibration_files/formats.hpp"
#include "calibration_files/lens_numbers.hpp"
#include "calibration_files/number_text.hpp"

namespace crane {
namespace {

using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

struct CameraInfo {
  CameraModel camera;
  std::vector<double> R, P;
};

Result<CameraInfo> read_camera_info(const NamedText& file) {
  auto root = yaml_document(file.text, file.name);
  if (!root) return root.error();
  DocumentReader y(*root, file.name);
  CameraInfo out;
  if (!set_image_size({y.number("image_width"), y.number("image_height")}, out.camera))
    y.problem("image_width", "and image_height are not a size in pixels");
  const auto k = y.matrix("camera_matrix", 3, 3);
  if (!k.empty() && !set_camera_matrix(k, out.camera))
    y.problem("camera_matrix", "is not [fx 0 cx, 0 fy cy, 0 0 1]");
  const std::string lens = y.text("distortion_model");
  const bool equidistant = lens == "equidistant" || lens == "fisheye";
  if (lens == "plumb_bob")
    set_lens_numbers(LensModel::kRadialTangential, y.vector("distortion_coefficients", {4, 5}),
                     out.camera);
  else if (lens == "rational_polynomial")
    set_lens_numbers(LensModel::kRational, y.vector("distortion_coefficients", {8}), out.camera);
  else if (equidistant)
    set_lens_numbers(LensModel::kEquidistant, y.vector("distortion_coefficients", {4}), out.camera);
  else
    y.problem("distortion_model",
              "'" + lens + "' is not plumb_bob, rational_polynomial or equidistant");
  out.R = y.matrix("rectification_matrix", 3, 3);
  out.P = y.matrix("projection_matrix", 3, 4);
  if (!out.P.empty() && !(out.P[0] > 0)) y.problem("projection_matrix", "has no focal length");
  if (auto done = y.finish(); !done) return done.error();
  return out;
}

std::string matrix_text(const std::string& key, int rows, int columns,
                        const std::vector<double>& m) {
  return key + ":\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(columns) +
         "\n  data: [" + number_list(m) + "]\n";
}

}  // namespace

Eigen::Isometry3d relation_of(const std::vector<double>& left, const std::vector<double>& right,
                              double shift_m) {
  const Rows R_left = Eigen::Map<const Rows>(left.data());
  const Rows R_right = Eigen::Map<const Rows>(right.data());
  Eigen::Isometry3d T_right_left = Eigen::Isometry3d::Identity();
  T_right_left.linear() = R_right.transpose() * R_left;
  T_right_left.translation() = R_right.transpose() * Eigen::Vector3d(shift_m, 0, 0);
  return T_right_left.inverse();
}

Result<Rectification> rectification_of(const StereoRig& rig, const std::string& format) {
  const Eigen::Isometry3d T = rig.T_right_left();
  if (std::abs(T.translation().x()) <= T.translation().tail<2>().norm())
    return Error{ErrorCode::kConfiguration, format,
                 "holds cameras side by side only, and these are not", "take another format"};
  const auto matrix = [](const CameraModel& c) {
    return cv::Mat(camera_matrix(c), true).reshape(1, 3);
  };
  const Rows rotation = T.linear();
  const cv::Mat R(3, 3, CV_64F, const_cast<double*>(rotation.data()));
  const cv::Mat t(3, 1, CV_64F, const_cast<double*>(T.translation().data()));
  const cv::Size size(int(rig.left.width), int(rig.left.height));
  const cv::Mat d[2] = {cv::Mat(lens_numbers(rig.left), true),
                        cv::Mat(lens_numbers(rig.right), true)};
  cv::Mat rotations[2], projections[2], Q;
  try {
    if (rig.left.lens == LensModel::kEquidistant)
      cv::fisheye::stereoRectify(matrix(rig.left), d[0], matrix(rig.right), d[1], size, R, t,
                                 rotations[0], rotations[1], projections[0], projections[1], Q,
                                 cv::CALIB_ZERO_DISPARITY);
    else
      cv::stereoRectify(matrix(rig.left), d[0], matrix(rig.right), d[1], size, R, t, rotations[0],
                        rotations[1], projections[0], projections[1], Q, cv::CALIB_ZERO_DISPARITY,
                        0);
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kConfiguration, format, "cannot be rectified: " + e.err, ""};
  }
  Rectification out;
  for (const int side : {0, 1}) {
    out.R[side].assign(rotations[side].begin<double>(), rotations[side].end<double>());
    out.P[side].assign(projections[side].begin<double>(), projections[side].end<double>());
  }
  return out;
}

Result<StereoRig> read_ros(const Texts& files) {
  auto left = read_camera_info(files[0]);
  if (!left) return left.error();
  auto right = read_camera_info(files[1]);
  if (!right) return right.error();
  if (right->P[3] >= 0)
    return Error{ErrorCode::kConfiguration, files[1].name,
                 "projection_matrix[0][3] is " + number_text(right->P[3]) +
                     ": of a right camera it is -fx * baseline",
                 left->P[3] < 0 ? "give left and right the other way round"
                                : "calibrate both cameras together (camera_calibration stereo)"};
  StereoRig rig;
  rig.left = left->camera;
  rig.right = right->camera;
  rig.T_left_right = relation_of(left->R, right->R, right->P[3] / right->P[0]);
  return rig;
}

Result<Texts> write_ros(const StereoRig& rig) {
  const auto rectified = rectification_of(rig, "ROS camera_info");
  if (!rectified) return rectified.error();
  Texts out;
  for (const int side : {0, 1}) {
    const CameraModel& c = side == 0 ? rig.left : rig.right;
    const std::string name = side == 0 ? "left" : "right";
    const auto d = lens_numbers(c);
    const char* lens = c.lens == LensModel::kEquidistant ? "equidistant"
                       : c.lens == LensModel::kRational  ? "rational_polynomial"
                                                         : "plumb_bob";
    out.push_back({name + ".yaml",
                   "image_width: " + std::to_string(c.width) +
                       "\nimage_height: " + std::to_string(c.height) + "\ncamera_name: " + name +
                       "\n" + matrix_text("camera_matrix", 3, 3, camera_matrix(c)) +
                       "distortion_model: " + lens + "\n" +
                       matrix_text("distortion_coefficients", 1, int(d.size()), d) +
                       matrix_text("rectification_matrix", 3, 3, rectified->R[side]) +
                       matrix_text("projection_matrix", 3, 4, rectified->P[side])});
  }
  return out;
}

}  // namespace crane
