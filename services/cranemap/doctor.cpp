// SPDX-License-Identifier: Apache-2.0
#include "doctor.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <thread>
#include <utility>

#include "base/clock.hpp"
#include "base/read_file.hpp"
#include "dds/endpoints.hpp"
#include "dds/host_checks.hpp"
#include "dds/observer.hpp"
#include "dds/security.hpp"
#include "dds/shared_memory.hpp"
#include "service/datagrams_refused.hpp"
#include "service/run_service.hpp"
#include "service/service_name.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;
using Verdict = Finding::Verdict;
using Network = NetworkSettings::Network;

/// An address of this host and whether its interface is up and can multicast.
struct Address {
  bool up = false, multicast = false;
};

std::map<std::string, Address> addresses() {
  std::map<std::string, Address> out;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return out;
  for (const ifaddrs* i = list; i != nullptr; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN] = "";
    inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr, text,
              sizeof text);
    out[text] = {(i->ifa_flags & IFF_UP) != 0,
                 (i->ifa_flags & (IFF_MULTICAST | IFF_LOOPBACK)) != 0};
  }
  freeifaddrs(list);
  return out;
}

/// Sends one datagram to the discovery group over an interface and hears it again.
bool multicast_works(const std::string& address) {
  const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (s < 0) return false;
  in_addr interface {};
  inet_pton(AF_INET, address.c_str(), &interface);
  ip_mreq group{};
  inet_pton(AF_INET, "239.255.0.1", &group.imr_multiaddr);
  group.imr_interface = interface;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  socklen_t size = sizeof to;
  const timeval limit{0, 300'000};
  char word[8] = "";
  bool good = bind(s, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0 &&
              getsockname(s, reinterpret_cast<sockaddr*>(&to), &size) == 0 &&
              setsockopt(s, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) == 0 &&
              setsockopt(s, IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface) == 0 &&
              setsockopt(s, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit) == 0;
  to.sin_addr = group.imr_multiaddr;
  good = good && sendto(s, "crane", 5, 0, reinterpret_cast<sockaddr*>(&to), sizeof to) == 5 &&
         recv(s, word, sizeof word, 0) == 5;
  close(s);
  return good;
}

class Examination {
 public:
  explicit Examination(const SiteConfig& config) : config_(config), dds_(config.dds) {}

  std::vector<Finding> host() {
    good("network", network_name(dds_.network) + ", domain " + std::to_string(dds_.domain) +
                        ", crane " + std::to_string(config_.crane));
    interfaces();
    if (dds_.network == Network::kLocal || dds_.network == Network::kContainer) multicast();
    if (dds_.uses_shared_memory()) shared_memory();
    note("socket buffers", dds::check_socket_buffers(dds_.udp_buffer_kib << 10U), "large enough",
         Verdict::kWarning);
    note("UDP ports", dds::check_udp_ports(dds_.domain),
         "there are free ones in domain " + std::to_string(dds_.domain));
    names("dds.servers", dds_.servers);
    names("dds.peers", dds_.peers);
    clock();
    security();
    return std::move(findings_);
  }

 private:
  void good(const std::string& what, const std::string& text) {
    findings_.push_back({Verdict::kGood, what, text, ""});
  }
  void bad(Verdict verdict, const std::string& what, const std::string& text,
           const std::string& advice) {
    findings_.push_back({verdict, what, text, advice});
  }
  template <class T>
  void note(const std::string& what, const Result<T>& result, const std::string& when_good,
            Verdict otherwise = Verdict::kBad) {
    if (result)
      good(what, when_good);
    else
      bad(otherwise, what, result.error().where + ": " + result.error().what, result.error().todo);
  }

  void interfaces() {
    const auto here = addresses();
    std::string all;
    for (const auto& [address, state] : here)
      if (state.up) all += (all.empty() ? "" : ", ") + address;
    if (dds_.interfaces.empty()) return good("interfaces", "all: " + all);
    for (const std::string& wanted : dds_.interfaces) {
      const auto found = here.find(wanted);
      if (found == here.end())
        bad(Verdict::kBad, "interfaces", wanted + " is no address of this host",
            "set dds.interfaces to some of: " + all);
      else if (!found->second.up)
        bad(Verdict::kBad, "interfaces", wanted + " is down", "ip link set ... up");
      else
        good("interfaces", wanted + " is up");
    }
    if (dds_.interfaces == std::vector<std::string>{"127.0.0.1"} && dds_.network != Network::kLocal)
      bad(Verdict::kWarning, "interfaces", "only loopback: nobody outside is reached",
          "set dds.interfaces");
  }

  void multicast() {
    for (const auto& [address, state] : addresses()) {
      const auto& used = dds_.interfaces;
      if (!state.up ||
          (!used.empty() && std::find(used.begin(), used.end(), address) == used.end()))
        continue;
      if (multicast_works(address))
        good("multicast", "works on " + address);
      else
        bad(used.empty() ? Verdict::kWarning : Verdict::kBad, "multicast",
            "a datagram to 239.255.0.1 does not come back on " + address,
            "allow multicast there, or use network: plant with servers or peers");
    }
  }

  void shared_memory() {
    const std::uint64_t needed = dds::shared_memory_needed(to_settings(config_, ""));
    note("shared memory", dds::check_shared_memory(needed),
         "/dev/shm has the " + std::to_string(needed >> 20U) + " MiB free that a process needs");
  }

  void names(const std::string& key, const std::vector<std::string>& hosts) {
    for (const std::string& text : hosts)
      note(key, dds::resolve_ipv4(text, key), text + " has an address");
  }

  void clock() {
    timex state{};
    if (adjtimex(&state) == TIME_ERROR || (state.status & STA_UNSYNC) != 0)
      bad(Verdict::kWarning, "clock", "is not synchronised: ages and clearance rely on it",
          "run chrony or systemd-timesyncd on every host");
    else
      good("clock", "synchronised");
  }

  void security() {
    if (dds_.security.empty()) {
      if (dds_.network != Network::kLocal)
        bad(Verdict::kWarning, "security", "is off: whoever reaches the network can write topics",
            "make certificates with deploy/security/make and set dds.security");
      return;
    }
    const std::string of_crane = dds_.security + "/crane_" + std::to_string(config_.crane);
    int identities = 0;
    for (const std::string& folder : {of_crane, dds_.security}) {
      std::error_code failed;
      for (std::filesystem::directory_iterator entry(folder, failed), end; !failed && entry != end;
           entry.increment(failed)) {
        const std::string name = entry->path().filename();
        const auto is_identity = is_folder(entry->path());
        if (!is_identity) note("security", is_identity, "");
        if (!is_identity || !*is_identity || name == "private" || name.starts_with("crane_"))
          continue;
        ++identities;
        identity(name);
      }
    }
    if (identities == 0)
      bad(Verdict::kBad, "security", "no identity in '" + dds_.security + "'",
          "make them with deploy/security/make");
  }

  void identity(const std::string& name) {
    const auto files = dds::check_security(
        dds_.security, {name, static_cast<std::uint32_t>(config_.crane), dds_.domain});
    if (!files)
      return bad(Verdict::kBad, "security", files.error().where + ": " + files.error().what,
                 files.error().todo);
    const auto days = files->days_left();
    const std::string text = name + ": certificate good for " + std::to_string(days) + " days";
    if (days < dds::kRenewDays)
      bad(Verdict::kWarning, "security", text, "renew it with deploy/security/make");
    else
      good("security", text);
    if (!files->ca_key.empty() && !std::exchange(said_ca_key_, true))
      bad(Verdict::kWarning, "security", "the CA's key is on this host",
          "keep " + files->ca_key + " elsewhere");
  }

  const SiteConfig& config_;
  const NetworkSettings& dds_;
  bool said_ca_key_ = false;
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> examine_host(const SiteConfig& config) {
  return Examination(config).host();
}

std::vector<Finding> examine_network(const SiteConfig& config, double seconds) {
  std::vector<Finding> out;
  dds::Settings settings = to_settings(config, "dashboard");
  // Takes no shared memory away from those that need it.
  settings.shared_memory = false;
  auto observer = dds::NetworkObserver::create(settings);
  if (!observer)
    return {{Verdict::kBad, "joining", observer.error().where + ": " + observer.error().what,
             observer.error().todo}};
  auto statuses = dds::Reader<dds::ServiceStatusTopic>::create((*observer)->participant(), nullptr);
  if (!statuses)
    return {{Verdict::kBad, "joining", statuses.error().text(), statuses.error().todo}};
  // How late their words come: never early, and sometimes at once.
  std::map<std::uint32_t, double> least_late_s;
  std::map<std::uint32_t, std::uint64_t> refused;  // datagrams, by service
  for (const Stopwatch watch; watch.ms() < seconds * 1000 && !stop_requested();) {
    while (const auto sample = statuses->take()) {
      const double late_s = double(SystemClock().now() - (*sample)->time_ns()) * 1e-9;
      const auto [it, first] = least_late_s.try_emplace((*sample)->pid(), late_s);
      if (!first) it->second = std::min(it->second, late_s);
      refused[(*sample)->service()] = datagrams_refused(**sample);
    }
    std::this_thread::sleep_for(5ms);
  }
  const auto peers = (*observer)->peers();
  for (const auto& peer : peers) {
    if (peer.refused)
      out.push_back({Verdict::kBad, "peer", peer.guid + " is refused: it is not authenticated",
                     "give it a certificate of this plant's CA"});
    else
      out.push_back({Verdict::kGood, "peer", peer.name + " (" + peer.guid + ")", ""});
  }
  if (peers.empty())
    out.push_back({Verdict::kWarning, "peers",
                   "nobody else is heard in " + std::to_string(int(std::ceil(seconds))) + " s",
                   "is a service running with the same dds section?"});
  for (const std::string& why : (*observer)->mismatches())
    out.push_back({Verdict::kBad, "mismatch", why, "see the topic's row in idl/README.md"});
  for (const auto& [pid, late_s] : least_late_s)
    if (late_s < -0.02 || late_s > 1.5)
      out.push_back({Verdict::kBad, "clock",
                     "of process " + std::to_string(pid) + " differs from ours by " +
                         std::to_string(-late_s) + " s",
                     "synchronise both hosts"});
  for (const auto& [service, count] : refused)
    if (count > 0)
      out.push_back({Verdict::kWarning, "datagrams",
                     std::string(service_name(service)) + " refused " + std::to_string(count) +
                         " since its start",
                     "its log says why, and its /metrics: cranemap_datagrams_refused_total; "
                     "somebody who sends them is on this network"});
  return out;
}

}  // namespace crane
