#include "geometry/stereo_rig.hpp"

#include <cmath>

namespace crane {
namespace {

bool is_rotation(const Eigen::Matrix3d& R) {
  return (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3 && R.determinant() > 0;
}

bool is_usable(const CameraModel& c) {
  const double values[] = {c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.k1, c.k2, c.p1, c.p2};
  for (double v : values)
    if (!std::isfinite(v)) return false;
  return c.width >= 16 && c.height >= 16 && c.fx_px > 1 && c.fy_px > 1;
}

}  // namespace

Result<void> check_rig(const StereoRig& rig, const std::string& where) {
  const auto bad = [&where](std::string what, std::string todo) {
    return Error{ErrorCode::kConfiguration, where, std::move(what), std::move(todo)};
  };
  if (!is_usable(rig.left) || !is_usable(rig.right))
    return bad(
        "a camera has no usable intrinsics (focal length, size or a value that is not finite)",
        "write intrinsics [fu, fv, cu, cv] in pixels and resolution [width, height]");
  if (rig.left.width != rig.right.width || rig.left.height != rig.right.height)
    return bad("left and right camera differ in resolution",
               "calibrate both at the same resolution");
  if (!is_rotation(rig.T_body_left.linear()) || !is_rotation(rig.T_body_right.linear()))
    return bad("the rotation in T_BS is not a rotation matrix",
               "copy the 4 x 4 matrix row by row from the calibration");
  if (!is_rotation(rig.T_map_camera_at_zero.linear()))
    return bad("the rotation in T_world_cam0 is not a rotation matrix", "see rig.yaml of a sample");
  const Eigen::Vector3d t = rig.T_right_left().translation();
  if (!(rig.baseline_m() > 0.005))
    return bad("the two cameras stand in the same place (baseline below 5 mm)",
               "check T_BS of cam0 and cam1");
  if (t.x() >= 0 || std::abs(t.x()) < 0.7 * t.norm())
    return bad("the right camera is not to the right of the left one",
               "cam0 must be the left camera; are the cameras swapped?");
  const Eigen::Vector3d view = (rig.T_map_camera_at_zero * rig.T_body_left).linear().col(2);
  if (view.z() > -0.5)
    return bad("the camera does not look down (its axis is more than 60 degrees off)",
               "T_world_cam0 maps camera axes into x runway, y bridge, z up");
  if (!(rig.camera_height_m() > 0.2))
    return bad("the camera is not above the floor", "give its height in T_world_cam0 in metres");
  return {};
}

}  // namespace crane
