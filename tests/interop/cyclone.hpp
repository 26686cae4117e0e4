// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

#include "system/live_services.hpp"

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

}  // namespace crane::test
