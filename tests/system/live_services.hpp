// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <list>

#include "system/process.hpp"
#include "temp_folder.hpp"

namespace crane::test {

/// Mapper, stereo, and players that go round the rig's recording without end.
/// In this order. Their configuration is `folder`/site.yaml.
/// With `state` the mapper keeps its map in `folder`/state.
inline std::list<Process> live_services(const TempFolder& folder, const std::string& domain,
                                        const std::string& rate = "real", bool state = false) {
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << domain << "}\n";
  std::list<Process> services;
  const auto start = [&](const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), {"cranemap-" + name, "--config", folder / "site.yaml"});
    services.emplace_back(more, folder / (name + ".txt"));
  };
  std::vector<std::string> mapper = {"--calibration", rig_recording()};
  if (state) mapper.insert(mapper.end(), {"--state", folder / "state"});
  start("mapper", mapper);
  start("stereo", {"--calibration", rig_recording()});
  for (const char* player : {"rangefinder", "camera"})
    start(player, {rig_recording(), "--rate", rate, "--loop", "--stream", "7"});
  return services;
}

}  // namespace crane::test
