// SPDX-License-Identifier: Apache-2.0
#include "gateway/foxglove_states.hpp"

#include "base/clock.hpp"
#include "bounds.h"
#include "gateway/foxglove_messages.hpp"
#include "service/service_name.hpp"

namespace crane::gateway {

void FoxgloveStates::place(TimeNs time, const Eigen::Vector2d& gantry_m, double skew_rad,
                           const std::optional<StereoRig>& rig,
                           const std::optional<v1::HoistState>& hoist) {
  if (time <= placed_ || !place_due_.due()) return;
  placed_ = time;
  std::vector<foxglove::Transform> all;
  if (rig) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().head<2>() = gantry_m;
    T.linear() = Eigen::AngleAxisd(skew_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    all.push_back({"map", "camera", T * rig->T_map_camera_at_zero});
  }
  if (hoist) {
    const v1::HoistState& h = *hoist;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() =
        Eigen::Vector3d(gantry_m.x() + hoist_.offset_x_m + h.sway_x_m(),
                        gantry_m.y() + hoist_.offset_y_m + h.sway_y_m(), h.hook_height_m());
    all.push_back({"map", "hook", T});
    if (h.load_size_z_m() > 0) {
      T = Eigen::AngleAxisd(h.load_yaw_rad(), Eigen::Vector3d::UnitZ());
      T.translation().z() = -h.sling_m() - h.load_size_z_m() / 2;
      all.push_back({"hook", "load", T});
    }
  }
  if (!all.empty())
    channels_.put(Channel::kTransforms, SystemClock().now(), foxglove::frame_transforms(time, all));
}

void FoxgloveStates::tell(const client::Status& map,
                          const std::map<std::uint32_t, v1::ServiceStatus>& services) {
  say("map", map.valid ? v1::STATUS_OK : v1::STATUS_DEGRADED, map.valid ? "valid" : map.reason);
  for (const auto& [number, s] : services)
    say(service_name(number), s.status(), s.message().size() == 0 ? "works" : s.message().c_str());
}

void FoxgloveStates::say(const std::string& name, std::uint32_t status, const std::string& text) {
  std::pair now{status, text};
  const auto [before, fresh] = said_.try_emplace(name, now);
  if (!fresh && before->second == now) return;
  before->second = std::move(now);
  const auto level = status == v1::STATUS_OK         ? foxglove::Level::kInfo
                     : status == v1::STATUS_DEGRADED ? foxglove::Level::kWarning
                                                     : foxglove::Level::kError;
  const TimeNs time = SystemClock().now();
  channels_.put(Channel::kLog, time, foxglove::log_line(time, level, name, text));
}

}  // namespace crane::gateway
