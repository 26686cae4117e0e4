// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/format.hpp"
#include "mount/mount_values.hpp"

namespace crane {
namespace {

constexpr double kClear = 5;  ///< sigmas
constexpr double kToldHeight = 0.05, kScale = 0.003, kSkew_deg = 0.1, kSlope_deg = 0.3;
constexpr double kTold_deg = 45, kPixels = 1, kReading_m = 0.02, kWithCamera = 0.1, kMoving = 0.3;
constexpr double kTargetReach_m = 0.25, kTarget_m = 0.02, kTargetShare = 0.01;
constexpr std::size_t kTargetPoints = 4;
constexpr const char* kAxisName[] = {"bridge", "trolley"};

/// Heights of points on top of it; nothing of this was used before.
TargetCheck check(const FloorTarget& target, const MountCalibration& c) {
  TargetCheck out;
  out.target = target;
  std::vector<double> heights;
  for (std::size_t i = 0; i < c.drive.points_m.size(); ++i) {
    const Eigen::Vector3d& p = c.drive.points_m[i];
    if ((p.head<2>() - target.place_m).norm() < kTargetReach_m && p.z() > target.height_m / 2)
      heights.push_back(p.z());
  }
  if (heights.size() < kTargetPoints) return out;
  out.seen = true;
  const auto middle = heights.begin() + std::ptrdiff_t(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  out.height_m = *middle;
  for (double& h : heights) h = std::abs(h - out.height_m);
  std::nth_element(heights.begin(), middle, heights.end());
  out.sigma_m = std::hypot(1.48 * *middle / std::sqrt(double(heights.size())),
                           c.of(MountItem::kHeight).sigma);
  const double height_m = c.rig.camera_height_m();
  out.agrees = std::abs(out.height_m - target.height_m) <
               3 * out.sigma_m + std::max(kTarget_m, kTargetShare * height_m);
  return out;
}

}  // namespace

void judge_mount(const Drive& drive, const MountOptions& options, const AxisReadings& readings,
                 const MountFit& fit, const std::vector<double>& levels_m, MountCalibration& out) {
  std::vector<std::string>& say = out.remarks;
  bool bad = false;
  bool good = true;
  for (const MountItem item :
       {MountItem::kHeight, MountItem::kTiltX, MountItem::kTiltY, MountItem::kYaw,
        MountItem::kCartDirection, MountItem::kTrolleyDirection, MountItem::kCartScale,
        MountItem::kTrolleyScale}) {
    const MountValue& v = out.of(item);
    if (v.determined) continue;
    bad = true;
    if (std::find(say.begin(), say.end(), v.why_not) == say.end()) say.push_back(v.why_not);
  }
  const auto better = [&](const std::string& text) {
    good = false;
    say.push_back(text);
  };
  if (fit.pixel_sigma > kPixels)
    better(
        formatted("points fit to %.2f px only: the cameras' calibration is not right, or the "
                  "mount sways; cranemap calibrate stereo",
                  fit.pixel_sigma));
  if (levels_m.size() > 1) {
    std::string list;
    for (const double l : levels_m) list += formatted("%s%.2f", list.empty() ? "" : ", ", l);
    better("several levels are seen, " + list +
           formatted(" m below the camera; %.2f m is taken for the floor, being nearest to what "
                     "was told. If it is not, drive where the floor is free",
                     fit.height_m));
  }
  const double off_m = fit.height_m - drive.told_height_m;
  if (std::abs(off_m) > kToldHeight * drive.told_height_m)
    better(
        formatted("the floor lies %.2f m below the camera, told were %.2f: is what the camera "
                  "saw the floor (and no platform), and the baseline right? Measure by tape",
                  fit.height_m, drive.told_height_m));
  const double all = double(std::max<std::size_t>(1, out.drive.tracks));
  if (double(out.drive.moving_with_camera) > kWithCamera * all)
    better(
        formatted("%.0f %% of the points come along with the camera (load, hook, or dirt on a "
                  "lens): they were left out",
                  100 * double(out.drive.moving_with_camera) / all));
  if (double(out.drive.moving_by_itself) > kMoving * all)
    better(formatted("%.0f %% of the points move by themselves: drive while nobody works there",
                     100 * double(out.drive.moving_by_itself) / all));
  const Eigen::Matrix3d turned =
      drive.rig.T_map_camera_at_zero.linear().transpose() * out.rig.T_map_camera_at_zero.linear();
  const double angle_deg = Eigen::AngleAxisd(turned).angle() * 180 / M_PI;
  if (angle_deg > kTold_deg)
    better(
        formatted("the camera is turned by %.0f degrees against what was told: it hangs so, or "
                  "the rangefinders of bridge and trolley are swapped (drive the bridge alone: "
                  "which reading changes?)",
                  angle_deg));
  for (const std::size_t k : {0U, 1U}) {
    const char* name = kAxisName[k];
    const MountValue& scale = out.of(k == 0 ? MountItem::kCartScale : MountItem::kTrolleyScale);
    if (scale.determined && std::abs(scale.value - 1) > kClear * scale.sigma &&
        std::abs(scale.value - 1) > kScale)
      better(formatted(
          "the %s's rangefinder says ways %.2f %% too %s: its beam is not along the rail, its unit "
          "is wrong, or the cameras' baseline is; rangefinders[].scale corrects live devices",
          name, 100 * std::abs(1 / scale.value - 1), scale.value < 1 ? "long" : "short"));
    const MountValue& latency =
        out.of(k == 0 ? MountItem::kCartLatency : MountItem::kTrolleyLatency);
    if (fit.driven[k] && !latency.determined)
      better(formatted("delay of the %s's rangefinder: ", name) + latency.why_not);
    if (out.drive.reading_sigma_m[int(k)] > kReading_m)
      better(formatted("readings of the %s fit to %.0f mm only", name,
                       1e3 * out.drive.reading_sigma_m[int(k)]));
    if (readings[k].repeats() > 1.5)
      better(
          formatted("the %s's rangefinder says each measurement %.1f times: it measures less "
                    "often than it speaks; repeats were left out",
                    name, readings[k].repeats()));
    const int told = k == 0 ? options.told.cart_direction : options.told.trolley_direction;
    const int now = k == 0 ? out.mapper.cart_direction : out.mapper.trolley_direction;
    const MountValue& offset = out.of(k == 0 ? MountItem::kCartOffset : MountItem::kTrolleyOffset);
    if (told != now && !offset.determined)
      better(
          formatted("the %s's direction is another than was told: its offset of %.3f m belongs "
                    "to the old one; measure it anew with --start X,Y",
                    name, k == 0 ? out.mapper.cart_offset_m : out.mapper.trolley_offset_m));
  }
  const auto significant = [&](MountItem item, double most) {
    const MountValue& v = out.of(item);
    return v.determined && std::abs(v.value) > most && std::abs(v.value) > kClear * v.sigma;
  };
  if (significant(MountItem::kSkew, kSkew_deg) && fit.skew_off.empty())
    better(
        formatted("the bridge stood skew by %.2f degrees: a second rangefinder at the other rail "
                  "lets the map follow it (mapper.rail_span_m)",
                  out.of(MountItem::kSkew).value));
  if (significant(MountItem::kFloorSlopeX, kSlope_deg) ||
      significant(MountItem::kFloorSlopeY, kSlope_deg))
    better(
        formatted("the floor is not parallel to the rails: it rises by %.2f degrees along the "
                  "runway and %.2f along the bridge; height 0 is the middle of the drive",
                  out.of(MountItem::kFloorSlopeX).value, out.of(MountItem::kFloorSlopeY).value));
  for (const FloorTarget& target : options.targets) {
    out.targets.push_back(check(target, out));
    const TargetCheck& t = out.targets.back();
    if (!t.seen)
      better(
          formatted("the target at %.2f, %.2f was not seen: drive over it, and see that its top "
                    "has texture (its place is that of the map: --start)",
                    target.place_m.x(), target.place_m.y()));
    else if (!t.agrees) {
      bad = true;
      say.push_back(formatted(
          "the target of %.3f m at %.2f, %.2f comes out as %.3f m: heights are wrong; measure the "
          "target, then the baseline (cranemap calibrate stereo)",
          target.height_m, target.place_m.x(), target.place_m.y(), t.height_m));
    }
  }
  out.verdict = bad ? MountVerdict::kBad : good ? MountVerdict::kGood : MountVerdict::kUsable;
}

}  // namespace crane
