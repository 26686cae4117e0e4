// SPDX-License-Identifier: Apache-2.0
#include "own_network.hpp"

#include <arpa/inet.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <fstream>

namespace crane::test {
namespace {

/// As root of a namespace of users of its own, where the machine lets nobody else.
bool as_somebody() {
  const auto user = std::to_string(getuid());
  const auto group = std::to_string(getgid());
  if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  std::ofstream("/proc/self/setgroups") << "deny";
  std::ofstream("/proc/self/gid_map") << "0 " << group << " 1";
  std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
  return getuid() == 0;
}

}  // namespace

bool own_network(const std::vector<std::string>& addresses) {
  if (unshare(CLONE_NEWNET) != 0 && !as_somebody()) return false;
  const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (s < 0) return false;
  bool good = true;
  for (std::size_t n = 0; n < addresses.size() && good; ++n) {
    ifreq r{};
    // The first is the interface's; others are by its aliases.
    const std::string name = n == 0 ? "lo" : "lo:" + std::to_string(n);
    std::strncpy(r.ifr_name, name.c_str(), sizeof r.ifr_name - 1);
    auto& address = reinterpret_cast<sockaddr_in&>(r.ifr_addr);
    address.sin_family = AF_INET;
    inet_pton(AF_INET, addresses[n].c_str(), &address.sin_addr);
    good = ioctl(s, SIOCSIFADDR, &r) == 0;
    inet_pton(AF_INET, "255.0.0.0", &address.sin_addr);
    good = good && ioctl(s, SIOCSIFNETMASK, &r) == 0;
  }
  ifreq up{};
  std::strncpy(up.ifr_name, "lo", sizeof up.ifr_name - 1);
  up.ifr_flags = IFF_UP | IFF_RUNNING;
  good = good && ioctl(s, SIOCSIFFLAGS, &up) == 0;
  close(s);
  return good;
}

}  // namespace crane::test
