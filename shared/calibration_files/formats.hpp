// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "geometry/stereo_rig.hpp"

// One pair of functions a format; calibration_files.hpp is for others. A reader leaves the mount
// as it is. Errors: Configuration, with file and line; of a writer: what the format cannot hold.

namespace crane {

struct NamedText {
  std::string name, text;
};
using Texts = std::vector<NamedText>;

/// Images that a file does not say the size of, or of which it holds several; 0 = not told.
struct AskedSize {
  std::uint32_t width = 0, height = 0;
};

Result<StereoRig> read_euroc(const Texts& left_right);
Result<Texts> write_euroc(const StereoRig& rig);
/// T_cn_cnm1 of cam1 takes points of cam0 into cam1: it is T_right_left.
Result<StereoRig> read_kalibr(const Texts& camchain);
Result<Texts> write_kalibr(const StereoRig& rig);
/// camera_info of left and right. Their relation is in the rectifications and in the right
/// camera's projection: x_rectified = R x_camera, and P[0][3] = -f * baseline.
Result<StereoRig> read_ros(const Texts& left_right);
Result<Texts> write_ros(const StereoRig& rig);
/// M1 D1 M2 D2 R T of the sample stereo_calib, in one file or two: x_right = R x_left + T.
Result<StereoRig> read_opencv(const Texts& files, const AskedSize& size);
Result<Texts> write_opencv(const StereoRig& rig, bool xml);
/// SN*.conf: millimetres; x_right = R x_left + (-Baseline, TY, TZ), R of the rotation vector
/// (RX, CV, RZ). `size` chooses among the resolutions.
Result<StereoRig> read_zed(const Texts& conf, const AskedSize& size);
Result<Texts> write_zed(const StereoRig& rig);
/// ORB-SLAM3: Stereo.T_c1_c2 takes points of camera 2 (right) into camera 1: it is T_left_right.
/// ORB-SLAM2: LEFT.R, RIGHT.R and RIGHT.P as ROS has them.
Result<StereoRig> read_orb_slam(const Texts& settings);
Result<Texts> write_orb_slam(const StereoRig& rig);
/// Two .cameramodel: extrinsics take points of the reference into the camera.
Result<StereoRig> read_mrcal(const Texts& left_right);

/// The relation of two cameras from their rectification: rotations row by row, and the x of the
/// left camera in the rectified right one [m], negative.
Eigen::Isometry3d relation_of(const std::vector<double>& left, const std::vector<double>& right,
                              double shift_m);
/// The same from OpenCV's stereoRectify: both rotations, and the projections (3 x 4), row by row.
struct Rectification {
  std::vector<double> R[2], P[2];
};
/// Error: Configuration, for cameras one above the other.
Result<Rectification> rectification_of(const StereoRig& rig, const std::string& format);

}  // namespace crane
