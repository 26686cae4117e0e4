// SPDX-License-Identifier: Apache-2.0
#pragma once

// Needs the C++17 standard library only: it is part of the client library's public headers.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace crane {

/// How a process joins a crane's DDS network. Section `dds` of the configuration, where each key
/// has the same name: docs/configuration.md says what is allowed.
struct NetworkSettings {
  /// kLocal: one host, zero-copy. kContainer: UDP, multicast discovery, no shared memory. kPlant:
  /// UDP, discovery by servers or peers only; over routers as well, to far hosts in a tunnel.
  enum class Network { kLocal, kContainer, kPlant };

  std::uint32_t domain = 0;
  Network network = Network::kLocal;
  /// IPv4 addresses of this host to use; empty = all. The default stays on this host.
  std::vector<std::string> interfaces = {"127.0.0.1"};
  std::vector<std::string> servers;  ///< discovery servers "host:port", of kPlant; 1 to 4
  std::vector<std::string> peers;    ///< further hosts to look for
  std::string security;              ///< folder of certificates; empty = no DDS Security
  std::string identity;              ///< of that folder; empty = the program's own
  /// With processes of this host; not said: with kLocal, and not else.
  std::optional<bool> shared_memory;
  std::uint32_t shm_segment_mib = 64;
  std::uint32_t udp_buffer_kib = 4096;
  /// Fast DDS XML and a participant profile in it, instead of network and what belongs to it.
  std::string profile_file, profile_name;

  [[nodiscard]] bool uses_shared_memory() const {
    return shared_memory.value_or(network == Network::kLocal);
  }
};

}  // namespace crane
