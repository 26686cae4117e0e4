// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "config/hoist_config.hpp"
#include "crane/client/map.hpp"
#include "dds/topics.hpp"
#include "gateway/foxglove_channels.hpp"
#include "geometry/stereo_rig.hpp"
#include "service/every.hpp"

namespace crane::gateway {

/// Where things are, and what changed of the states: for viewers. One thread.
class FoxgloveStates {
 public:
  FoxgloveStates(FoxgloveChannels& channels, const HoistConfig& hoist)
      : channels_(channels), hoist_(hoist) {}

  /// map -> camera (nothing without `rig`), map -> hook, hook -> load (its middle), at most 10
  /// times a second. `time`: of the positions.
  void place(TimeNs time, const Eigen::Vector2d& gantry_m, double skew_rad,
             const std::optional<StereoRig>& rig, const std::optional<v1::HoistState>& hoist);
  /// Of the map's validity and of each service a line whenever it changes.
  void tell(const client::Status& map, const std::map<std::uint32_t, v1::ServiceStatus>& services);

 private:
  void say(const std::string& name, std::uint32_t status, const std::string& text);

  FoxgloveChannels& channels_;
  HoistConfig hoist_;
  Every place_due_{10};
  TimeNs placed_ = 0;
  std::map<std::string, std::pair<std::uint32_t, std::string>> said_;
};

}  // namespace crane::gateway
