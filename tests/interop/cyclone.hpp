#pragma once

#include <cstdlib>
#include <fstream>
#include <list>

#include "system/process.hpp"
#include "temp_folder.hpp"

namespace crane::test {

/// A program on Cyclone DDS, kept to loopback as ours are.
inline Process cyclone(const std::string& program, std::vector<std::string> arguments,
                       const std::string& output) {
  // Unicast: loopback interfaces do no multicast. Receive buffers for whole frames.
  setenv("CYCLONEDDS_URI",
         "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address='127.0.0.1' "
         "multicast='false'/></Interfaces><AllowMulticast>false</AllowMulticast>"
         "<MaxMessageSize>65500B</MaxMessageSize></General><Discovery>"
         "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60"
         "</MaxAutoParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
         "<Internal><SocketReceiveBufferSize min='4MB'/></Internal></Domain></CycloneDDS>",
         1);
  arguments.insert(arguments.begin(), program);
  return Process(std::move(arguments), output);
}

/// Mapper, stereo, and players that go round the rig's recording without end.
/// Their configuration is `folder`/site.yaml.
inline std::list<Process> live_services(const TempFolder& folder, const std::string& domain) {
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << domain << "}\n";
  std::list<Process> services;
  const auto start = [&](const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), {"cranemap-" + name, "--config", folder / "site.yaml"});
    services.emplace_back(more, folder / (name + ".txt"));
  };
  start("mapper", {"--calibration", rig_recording()});
  start("stereo", {"--calibration", rig_recording()});
  for (const char* player : {"rangefinder", "camera"})
    start(player, {rig_recording(), "--rate", "real", "--loop", "--stream", "7"});
  return services;
}

}  // namespace crane::test
