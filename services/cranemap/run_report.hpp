// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "crane/client/map.hpp"
#include "dds/topics.hpp"
#include "evaluation/evaluation.hpp"
#include "obstacle_heights.hpp"

namespace crane {

/// All that is known of a run when it has ended.
struct RunReport {
  std::string recording, method, rate, network;
  std::string verb = "recorded";  ///< of the frames, for people
  double wall_s = 0;
  std::size_t frames = 0;  ///< of the recording
  client::Status map;
  client::Map::VoxelCount voxels;
  std::map<std::uint32_t, v1::ServiceStatus> services;  ///< last status by v1::SERVICE_*
  std::map<std::string, int> restarts;
  std::map<std::string, std::uintmax_t> files;  ///< bytes
  std::vector<ObstacleHeight> heights;
  bool judged = false;
  Evaluation judgement;
};

/// Error: Resource.
Result<void> write_json(const std::string& path, const RunReport& report);
/// The same for people, on stdout.
void print(const RunReport& report);

}  // namespace crane
