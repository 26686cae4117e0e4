// SPDX-License-Identifier: Apache-2.0
#include "mount/mount_calibration.hpp"

#include <algorithm>
#include <cmath>

#include "base/format.hpp"
#include "mount/mount_fit.hpp"
#include "mount/mount_values.hpp"

namespace crane {
namespace {

constexpr std::size_t kLeastFloor = 30;
constexpr double kFarReadings = 0.1;  ///< share of frames from which on an axis is not believed
constexpr const char* kAxisName[] = {"bridge", "trolley"};

MountCalibration useless(const Drive& drive, const MountOptions& options, const std::string& why) {
  MountCalibration out;
  out.rig = drive.rig;
  out.mapper = options.told;
  for (std::size_t i = 0; i < kMountItems; ++i) {
    out.values[i].item = MountItem(i);
    out.values[i].why_not = "the drive is of no use";
  }
  out.remarks.push_back(why);
  out.drive.frames = drive.frames.size();
  out.drive.tracks = drive.tracks;
  if (!drive.frames.empty())
    out.drive.seconds = double(drive.frames.back().time - drive.frames.front().time) * 1e-9;
  return out;
}

Eigen::Matrix3d told_rotation(const Drive& drive) {
  return drive.rig.T_map_camera_at_zero.linear() * drive.camera.R_camera_rectified;
}

/// What a second rangefinder of the bridge says of its skew, against the mean.
void follow_skew(const Drive& drive, const MountOptions& options, const AxisReadings& readings,
                 MountFit& fit) {
  const MapperConfig& told = options.told;
  const Readings second(drive.cart_second, drive.frames.front().time, told);
  if (!second.flaw().empty() || !fit.driven[0]) return;
  double xx = 0, xy = 0, mean_second = 0;
  std::vector<double> seconds, firsts;
  for (std::size_t i = fit.first; i < fit.last; ++i) {
    const double t = double(drive.frames[i].time - drive.frames.front().time) * 1e-9;
    firsts.push_back(readings[0].at(t + fit.latency_s[0]));
    seconds.push_back(second.at(t + fit.latency_s[0]));
    mean_second += seconds.back();
  }
  double mean_first = 0;
  for (const double f : firsts) mean_first += f;
  mean_first /= double(firsts.size()), mean_second /= double(firsts.size());
  for (std::size_t i = 0; i < firsts.size(); ++i) {
    xx += (firsts[i] - mean_first) * (firsts[i] - mean_first);
    xy += (firsts[i] - mean_first) * (seconds[i] - mean_second);
  }
  const double gain = fit.gain[0] * (xy > 0 ? 1 : -1);
  for (std::size_t i = 0; i < firsts.size(); ++i)
    fit.skew_off.push_back(
        (gain * (seconds[i] - mean_second) - fit.gain[0] * (firsts[i] - mean_first)) /
        told.rail_span_m);
  const double offset_m = options.start_m ? options.start_m->y() - fit.gain[1] * readings[1].at(0)
                                          : told.trolley_offset_m;
  const double y_at_zero = offset_m + fit.gain[1] * fit.mean_m[1];
  fit.rail_y_m = told.rail_y_m - y_at_zero;
}

}  // namespace

MountCalibration calibrate_mount(const Drive& drive, const MountOptions& options) {
  if (drive.frames.size() < 10)
    return useless(
        drive, options,
        formatted("%zu frames are too few: record a drive of at least 20 s", drive.frames.size()));
  const TimeNs from = drive.frames.front().time;
  const AxisReadings readings = {Readings(drive.cart, from, options.told),
                                 Readings(drive.trolley, from, options.told)};
  for (const std::size_t k : {0U, 1U})
    if (!readings[k].flaw().empty())
      return useless(drive, options,
                     formatted("the %s's rangefinder ", kAxisName[k]) + readings[k].flaw());
  std::string flaw;
  auto fit = first_guess(drive, readings, told_rotation(drive),
                         {options.told.cart_direction, options.told.trolley_direction},
                         options.cart_direction, flaw);
  if (!fit) return useless(drive, options, flaw);
  if (options.told.rail_span_m != 0) follow_skew(drive, options, readings, *fit);
  if (!refine(drive, readings, *fit))
    return useless(drive, options, "images and readings do not fit together: record another drive");
  std::vector<double> levels_m;
  find_floor(drive, *fit, levels_m);
  const auto floor =
      std::size_t(std::count(fit->kinds.begin(), fit->kinds.end(), TrackKind::kFloor));
  if (floor < kLeastFloor)
    return useless(drive, options,
                   formatted("only %zu points lie on one level: no floor is to be seen; drive "
                             "where at least a third of the view is free floor",
                             floor));
  for (const std::size_t k : {0U, 1U})
    if (fit->far_readings[k] > kFarReadings)
      return useless(
          drive, options,
          formatted("%.0f %% of the %s's readings are far off what the images say (stuck, jumping, "
                    "or times of another clock): look at the device and its target",
                    100 * fit->far_readings[k], kAxisName[k]));
  MountCalibration out = mount_values(drive, options, readings, *fit);
  judge_mount(drive, options, readings, *fit, levels_m, out);
  return out;
}

}  // namespace crane
