// SPDX-License-Identifier: Apache-2.0
#include "dds/host_checks.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <set>
#include <string>

#include "base/log.hpp"

namespace crane::dds {

Result<void> check_socket_buffers(std::uint32_t wanted) {
  for (const char* name : {"rmem_max", "wmem_max"}) {
    std::ifstream file(std::string("/proc/sys/net/core/") + name);
    std::uint64_t granted = 0;
    if (file >> granted && granted < wanted)
      return Error{ErrorCode::kResource, std::string("net.core.") + name,
                   std::to_string(granted) + " bytes, " + std::to_string(wanted) +
                       " wanted: large samples over UDP can be lost and sent again",
                   std::string("sysctl -w net.core.") + name + "=" + std::to_string(wanted)};
  }
  return {};
}

Result<void> check_udp_ports(std::uint32_t domain) {
  // RTPS 2.2, 9.6.1.1: the participants' ports of a domain lie between its own and the next one's.
  const int first = 7400 + 250 * static_cast<int>(domain) + 10;
  for (int port = first; port < first + 240; port += 2) {
    const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (probe < 0)
      return Error{ErrorCode::kResource, "UDP", "no socket can be opened", "raise 'ulimit -n'"};
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    const bool free = bind(probe, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    close(probe);
    if (free) return {};
  }
  return Error{
      ErrorCode::kResource, "DDS domain " + std::to_string(domain),
      "no free UDP port from " + std::to_string(first) + " to " + std::to_string(first + 240),
      "stop other participants of the domain, or choose another dds.domain"};
}

Result<void> check_interfaces(const std::vector<std::string>& wanted) {
  std::set<std::string> own;
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0)
    return Error{ErrorCode::kResource, "dds.interfaces", "this host's addresses cannot be read",
                 ""};
  for (const ifaddrs* i = first; i != nullptr; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN] = "";
    inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr, text,
              sizeof text);
    own.insert(text);
  }
  freeifaddrs(first);
  std::string missing;
  std::size_t there = 0;
  for (const std::string& address : wanted)
    if (own.contains(address))
      ++there;
    else
      missing += (missing.empty() ? "" : ", ") + address;
  if (missing.empty()) return {};
  std::string all;
  for (const std::string& address : own) all += (all.empty() ? "" : ", ") + address;
  const Error error{ErrorCode::kConfiguration, "dds.interfaces",
                    missing + " is no address of this host",
                    "set it to some of: " + all + "; [] = all of them"};
  if (there == 0) return error;
  log_warning(error.text() + "; going on without");
  return {};
}

Result<std::string> resolve_ipv4(const std::string& text, const std::string& key) {
  const std::string host = text.substr(0, text.rfind(':'));
  addrinfo wanted{};
  wanted.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (const int failed = getaddrinfo(host.c_str(), nullptr, &wanted, &found); failed != 0)
    return Error{ErrorCode::kResource, key,
                 "'" + host + "' has no address: " + gai_strerror(failed),
                 "check the name and the name server, or give an IPv4 address"};
  char address[INET_ADDRSTRLEN] = "";
  inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr, address,
            sizeof address);
  freeaddrinfo(found);
  return std::string(address);
}

}  // namespace crane::dds
