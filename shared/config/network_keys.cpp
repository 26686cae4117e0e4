// SPDX-License-Identifier: Apache-2.0
#include "config/network_keys.hpp"

#include <arpa/inet.h>

#include <charconv>

#include "config/key.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

using Network = NetworkSettings::Network;

/// As Network counts.
const std::vector<std::string> kNetworks = {"local", "container", "plant"};

/// "host:port"; the host may be a name.
bool has_port(const std::string& text) {
  const auto colon = text.rfind(':');
  int port = 0;
  if (colon == std::string::npos || colon == 0) return false;
  const char* end = text.data() + text.size();
  const auto [stop, failed] = std::from_chars(text.data() + colon + 1, end, port);
  return failed == std::errc() && stop == end && port >= 1 && port <= 65'535;
}

/// What was a network once.
bool is_gone(YamlReader& y) {
  if (y.has("tcp_port")) y.problem("tcp_port", "is gone, as network: wan is");
  std::string called;
  y.text("network", called);
  if (called != "wan") return false;
  y.problem("network",
            "'wan' is gone: Fast DDS's TCP ends by 18 bytes of anybody. Use network: plant with "
            "peers, through a tunnel: deploy/network/README.md shows one");
  return true;
}

void check_servers(YamlReader& y, const NetworkSettings& c) {
  if (!c.servers.empty() && !c.security.empty())
    y.problem("servers", "do not go with security: Fast DDS 2.9 ends by an assertion; give peers");
  if (!c.servers.empty() && c.network != Network::kPlant)
    y.problem("servers", "are for network: plant");
  if (c.servers.size() > 4) y.problem("servers", "are more than 4");
  for (const std::string& server : c.servers)
    if (!has_port(server)) y.problem("servers", "'" + server + "' must be host:port");
}

void check(YamlReader& y, const NetworkSettings& c) {
  for (const std::string& address : c.interfaces)
    if (in_addr ignored{}; inet_pton(AF_INET, address.c_str(), &ignored) != 1)
      y.problem("interfaces", "'" + address +
                                  "' is no IPv4 address of this host, such as 127.0.0.1: names, "
                                  "networks (/8) and IPv6 are not known to Fast DDS");
  if (!c.profile_file.empty() && c.profile_name.empty())
    y.problem("profile_name", "must name a participant profile of profile_file");
  if (c.network == Network::kPlant) {
    if (!y.has("interfaces"))
      y.problem("interfaces", "must list this host's addresses to use; [] = all");
    if (c.servers.empty() && c.peers.empty())
      y.problem("servers", "or peers must be given: a plant's network has no multicast");
  }
  check_servers(y, c);
}

}  // namespace

void keys(KeyVisitor& v, NetworkSettings& c) {
  YamlReader* y = v.reading();
  v.integer({"domain", "DDS domain"}, c.domain, {0, 232});
  if (y == nullptr || !is_gone(*y))
    v.choice({"network",
              "local: one host, zero-copy; container: UDP, found by multicast; plant: UDP, found "
              "by servers or peers only, over routers as well: deploy/network/README.md"},
             c.network, kNetworks);
  if (y != nullptr && c.network != Network::kLocal) c.interfaces.clear();
  v.texts(Key("interfaces", "IPv4 addresses of this host to use: nothing leaves by others; []: all")
              .by_default("[127.0.0.1] for local, [] for container; plant must say"),
          c.interfaces);
  v.texts({"servers", "plant: discovery servers host:port, at most 4"}, c.servers);
  v.texts({"peers", "hosts to look for, host or host:port"}, c.peers);
  v.text({"security",
          "folder of certificates and permissions, of deploy/security/make: DDS Security is on"},
         c.security);
  v.text(Key("identity", "who this is, of that folder").by_default("by the program's name"),
         c.identity);
  bool shared = c.uses_shared_memory();
  v.flag(Key("shared_memory", "between processes of this host")
             .by_default("true for local, else false"),
         shared);
  if (shared != c.uses_shared_memory()) c.shared_memory = shared;
  v.integer({"shm_segment_mib", "of shared memory a process"}, c.shm_segment_mib, {16, 1024});
  v.integer({"udp_buffer_kib", "of a socket"}, c.udp_buffer_kib, {64, 65'536});
  v.text(
      {"profile_file",
       "Fast DDS XML for transport, discovery and security, instead of network and what it uses"},
      c.profile_file);
  v.text({"profile_name", "participant profile of profile_file"}, c.profile_name);
  if (y != nullptr) check(*y, c);
}

const std::string& network_name(NetworkSettings::Network network) {
  return kNetworks[static_cast<std::size_t>(network)];
}

}  // namespace crane
