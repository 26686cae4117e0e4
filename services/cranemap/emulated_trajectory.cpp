// SPDX-License-Identifier: Apache-2.0
#include "emulated_trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "sim/noise.hpp"

namespace crane {

Result<EmulatedTrajectory> EmulatedTrajectory::of_recording(const std::string& folder, bool cart) {
  EmulatedTrajectory t{ToAndFro{}};
  const auto recording = Recording::open(folder);
  if (!recording) return recording.error();
  t.start_ = recording->start();
  t.period_ = recording->loop_period();
  for (const RecordedDistance& d : cart ? recording->cart() : recording->trolley())
    if (std::isfinite(d.distance_m)) t.recorded_.push_back(d);
  if (t.recorded_.size() < 2)
    return Error{ErrorCode::kBadData, folder,
                 std::string("has no distances of axis ") + (cart ? "cart" : "trolley"), ""};
  return t;
}

EmulatedTrajectory EmulatedTrajectory::of_scene(Scene scene, bool cart) {
  EmulatedTrajectory t{ToAndFro{}};
  t.scene_ = std::move(scene);
  t.cart_ = cart;
  return t;
}

double EmulatedTrajectory::at(double seconds) const {
  if (scene_) {
    const SceneRangefinder& r = scene_->rangefinder;
    const double since = seconds - double(kBeforeFirstImage) * 1e-9 - r.delay_ms * 1e-3;
    const Eigen::Vector2d gantry = gantry_at(scene_->motion, since);
    const auto instant = static_cast<std::uint64_t>(std::llround(seconds * 1e6));
    const std::uint64_t seed = scene_->seed ^ (cart_ ? 0xCA47U : 0x7401U);
    return (cart_ ? gantry.x() : gantry.y()) + r.sigma_m * double(gaussian(instant ^ mix(seed)));
  }
  if (!recorded_.empty()) {
    const TimeNs time = start_ + std::max<TimeNs>(0, static_cast<TimeNs>(seconds * 1e9)) % period_;
    std::size_t i = 1;
    while (i + 1 < recorded_.size() && recorded_[i].time < time) ++i;
    const RecordedDistance& a = recorded_[i - 1];
    const RecordedDistance& b = recorded_[i];
    const double share = double(time - a.time) / double(std::max<TimeNs>(b.time - a.time, 1));
    return a.distance_m + (b.distance_m - a.distance_m) * std::clamp(share, 0.0, 1.0);
  }
  const ToAndFro& o = to_and_fro_;
  const double length = std::abs(o.to_m - o.from_m);
  if (length == 0 || o.speed_mps == 0) return o.from_m;
  const double way = std::fmod(std::abs(o.speed_mps) * seconds, 2 * length);
  const double share = (way < length ? way : 2 * length - way) / length;
  return o.from_m + (o.to_m - o.from_m) * share;
}

}  // namespace crane
