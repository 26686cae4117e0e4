// SPDX-License-Identifier: Apache-2.0
#include "geometry/stereo_rig.hpp"

#include <algorithm>
#include <cmath>

#include "base/format.hpp"

namespace crane {
namespace {

constexpr double kHighest_m = 100;      ///< no bridge crane's camera hangs higher
constexpr double kLongest_m = 5;        ///< baseline
constexpr double kFarthest_m = 10'000;  ///< from where cart and trolley read zero
constexpr double kLeastDisparity_px = 2;
constexpr double kOffCentre = 0.25;  ///< of the image's size; further off: no lens is so built
constexpr double kScaled = 0.08;     ///< the same in both directions: of another resolution
constexpr double kTangential = 0.05;

/// Whether the lens model maps growing angles to growing radii as far as the nearest border of the
/// image. Coefficients of another lens, or in another order, fold the image back; those of real
/// ones do at most in its corners.
bool lens_unfolds(const CameraModel& c) {
  const double border = 0.5 * std::min(c.width / c.fx_px, c.height / c.fy_px);
  const bool angle = c.lens == LensModel::kEquidistant;
  const double most = angle ? 3.14 : 20;
  constexpr double kStep = 0.002;
  double before = 0;
  for (double ray = kStep; ray < most; ray += kStep) {
    const double radius = lens_radius(c, ray);
    if (!(radius > before) || radius > before + 0.5) return false;  // a pole, too
    if (radius >= border) return true;
    before = radius;
  }
  return false;
}

std::string lens_text(const CameraModel& c) {
  if (c.lens == LensModel::kEquidistant)
    return formatted("(equidistant, k1 %g, k2 %g, k3 %g, k4 %g)", c.k1, c.k2, c.k3, c.k4);
  std::string text = formatted("(k1 %g, k2 %g, p1 %g, p2 %g", c.k1, c.k2, c.p1, c.p2);
  if (c.k3 != 0 || c.lens == LensModel::kRational) text += formatted(", k3 %g", c.k3);
  if (c.lens == LensModel::kRational) text += formatted(", k4 %g, k5 %g, k6 %g", c.k4, c.k5, c.k6);
  return text + ")";
}

/// What cannot be true of a camera; empty = nothing.
std::string camera_flaw(const CameraModel& c) {
  for (double v :
       {c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.k1, c.k2, c.p1, c.p2, c.k3, c.k4, c.k5, c.k6})
    if (!std::isfinite(v)) return "holds a value that is not finite";
  if (c.width < 16 || c.height < 16) return "has an image of less than 16 pixels";
  if (c.fx_px < 0.1 * c.width || c.fx_px > 50.0 * c.width)
    return formatted("has a focal length of %g px for an image %u px wide", c.fx_px, c.width);
  if (c.fy_px < 0.8 * c.fx_px || c.fy_px > 1.25 * c.fx_px)
    return formatted("has focal lengths that differ (%g and %g px)", c.fx_px, c.fy_px);
  const double x = c.cx_px / c.width - 0.5;
  const double y = c.cy_px / c.height - 0.5;
  const bool outside = std::abs(x) >= 0.5 || std::abs(y) >= 0.5;
  const bool scaled = std::abs(x) > kScaled && std::abs(y) > kScaled && std::abs(x - y) < 0.03;
  if (outside || scaled || std::max(std::abs(x), std::abs(y)) >= kOffCentre) {
    std::string text =
        formatted("has its principal point at (%g, %g), %s of an image of %u x %u", c.cx_px,
                  c.cy_px, outside ? "outside" : "far from the middle", c.width, c.height);
    if (scaled || outside)
      text += formatted(" (the middle of one of %.0f x %.0f)", 2 * c.cx_px + 1, 2 * c.cy_px + 1);
    return text;
  }
  if (std::max(std::abs(c.p1), std::abs(c.p2)) > kTangential || !lens_unfolds(c))
    return "has a lens " + lens_text(c) + " that folds the image";
  return "";
}

}  // namespace

double lens_radius(const CameraModel& c, double ray) {
  const double r2 = ray * ray;
  if (c.lens == LensModel::kEquidistant)
    return ray * (1 + r2 * (c.k1 + r2 * (c.k2 + r2 * (c.k3 + r2 * c.k4))));
  const double above = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  const double below = 1 + r2 * (c.k4 + r2 * (c.k5 + r2 * c.k6));
  return ray * above / below;
}

Result<void> check_rotation(const Eigen::Matrix3d& R, const std::string& where,
                            const std::string& name) {
  const double off = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  const bool mirrored = R.determinant() < 0;
  if (off < 1e-3 && !mirrored) return {};
  return Error{
      ErrorCode::kConfiguration, where,
      "the rotation in " + name + " is not a rotation matrix: " +
          (off < 1e-3 ? "it mirrors (determinant -1)"
                      : formatted("its rows are not of length 1 and at right angles (off by "
                                  "%.2g)",
                                  off)),
      mirrored && off < 1e-3 ? "one axis has the wrong sign: copy the matrix row by row"
                             : "copy the 4 x 4 matrix row by row from the calibration"};
}

Result<void> check_rig(const StereoRig& rig, const std::string& where) {
  const auto bad = [&where](std::string what, std::string todo) {
    return Error{ErrorCode::kConfiguration, where, std::move(what), std::move(todo)};
  };
  for (const bool left : {true, false})
    if (const std::string flaw = camera_flaw(left ? rig.left : rig.right); !flaw.empty())
      return bad(std::string(left ? "cam0" : "cam1") + " " + flaw,
                 "write intrinsics [fu, fv, cu, cv] and distortion, of the model that is named, of "
                 "images of just this resolution");
  if (rig.left.width != rig.right.width || rig.left.height != rig.right.height)
    return bad("left and right camera differ in resolution",
               "calibrate both at the same resolution");
  if ((rig.left.lens == LensModel::kEquidistant) != (rig.right.lens == LensModel::kEquidistant))
    return bad("one camera has an equidistant lens and the other one has not",
               "calibrate both with the same distortion_model");
  const double focal = rig.left.fx_px / rig.right.fx_px;
  if (focal < 0.8 || focal > 1.25)
    return bad(formatted("the focal lengths of cam0 and cam1 differ (%g and %g px)", rig.left.fx_px,
                         rig.right.fx_px),
               "calibrate both at the same resolution and with the same lenses");
  if (auto r = check_rotation(rig.T_left_right.linear(), where, "T_BS"); !r) return r;
  if (auto r = check_rotation(rig.T_map_camera_at_zero.linear(), where, "T_world_cam0"); !r)
    return r;
  const double baseline = rig.baseline_m();
  if (!(baseline > 0.005))
    return bad(formatted("baseline %g m: the two cameras stand in the same place", baseline),
               "check T_BS of cam0 and cam1: its translation is in metres");
  if (!(baseline <= kLongest_m))
    return bad(formatted("baseline %g m: no stereo camera is so wide", baseline),
               "check T_BS of cam0 and cam1: its translation is in metres, not millimetres");
  const Eigen::Vector3d t = rig.T_right_left().translation();
  if (t.x() >= 0 || std::abs(t.x()) < 0.7 * t.norm())
    return bad("the right camera is not to the right of the left one",
               "cam0 must be the left camera: are the cameras swapped, or T_BS the wrong way round "
               "(it maps camera into body)?");
  const Eigen::Vector3d at = rig.T_map_camera_at_zero.translation();
  const double height = rig.camera_height_m();
  if (!(height > 0.2))
    return bad(formatted("the camera is not above the floor (height %g m)", height),
               "give its height in T_world_cam0 in metres");
  if (!(height <= kHighest_m))
    return bad(formatted("camera height %g m: no bridge crane is so high", height),
               "T_world_cam0 is in metres, not millimetres");
  if (!(std::max(std::abs(at.x()), std::abs(at.y())) <= kFarthest_m))
    return bad(formatted("the camera is %g m from where cart and trolley read zero",
                         std::max(std::abs(at.x()), std::abs(at.y()))),
               "T_world_cam0 is in metres, not millimetres");
  if (rig.T_map_camera_at_zero.linear().col(2).z() > -0.5)
    return bad("the camera does not look down (its axis is more than 60 degrees off)",
               "T_world_cam0 maps camera axes into x runway, y bridge, z up");
  const double floor_px = rig.left.fx_px * baseline / height;
  if (floor_px < kLeastDisparity_px || baseline > height)
    return bad(formatted("baseline %g m and camera height %g m do not go together: the floor has a "
                         "disparity of %.1f px",
                         baseline, height, floor_px),
               "check T_BS and T_world_cam0: both are in metres");
  return {};
}

}  // namespace crane
