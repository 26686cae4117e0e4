// SPDX-License-Identifier: Apache-2.0
// Who announces itself with somebody else's address has us flood that one: announcements go there
// twice a second, for as long as the lease says. Two hosts on a wire; the other is the third party.

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <thread>

#include "../rtps/build.hpp"
#include "domain.hpp"
#include "victim.hpp"

namespace crane::test {
namespace {

constexpr const char *kOurs = "10.77.0.1", *kTheirs = "10.77.0.2";
constexpr std::uint16_t kPort = 9999;

/// Two network namespaces and a wire between them.
class TwoHosts {
 public:
  TwoHosts() {
    const std::string setup =
        "{ ip netns add " + ours() + " && ip netns add " + theirs() + " && ip -n " + ours() +
        " link add wire type veth peer name wire netns " + theirs() + " && ip -n " + ours() +
        " addr add 10.77.0.1/24 dev wire && ip -n " + theirs() +
        " addr add 10.77.0.2/24 dev wire && for host in " + ours() + " " + theirs() +
        "; do ip -n $host link set lo up && ip -n $host link set wire up || exit 1; done; } "
        "> /dev/null 2>&1";
    works_ = std::system(setup.c_str()) == 0;
  }
  ~TwoHosts() {
    for (const std::string& host : {ours(), theirs()})
      (void)std::system(("ip netns del " + host + " > /dev/null 2>&1").c_str());
  }
  TwoHosts(const TwoHosts&) = delete;
  TwoHosts& operator=(const TwoHosts&) = delete;
  [[nodiscard]] bool works() const { return works_; }
  static std::string ours() { return "cranemap-a" + std::to_string(getpid()); }
  static std::string theirs() { return "cranemap-b" + std::to_string(getpid()); }

 private:
  bool works_ = false;
};

/// A UDP socket on one of the hosts.
class HostSocket {
 public:
  explicit HostSocket(const std::string& host) {
    std::thread([&] {  // a namespace is a thread's
      const int space = open(("/run/netns/" + host).c_str(), O_RDONLY | O_CLOEXEC);
      if (space >= 0 && setns(space, CLONE_NEWNET) == 0)
        socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
      if (space >= 0) close(space);
    })
        .join();
    // At all addresses: Fast DDS turns those of its own host into the loopback's.
    const sockaddr_in at = to("0.0.0.0", kPort);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  }
  ~HostSocket() { close(socket_); }
  HostSocket(const HostSocket&) = delete;
  HostSocket& operator=(const HostSocket&) = delete;

  void send(const Datagram& d, const char* address, std::uint16_t port) const {
    const sockaddr_in at = to(address, port);
    EXPECT_GT(
        sendto(socket_, d.data(), d.size(), 0, reinterpret_cast<const sockaddr*>(&at), sizeof at),
        0);
  }
  /// Datagrams that came so far.
  int received() {
    char byte = 0;
    while (recv(socket_, &byte, 1, MSG_DONTWAIT | MSG_TRUNC) >= 0) ++received_;
    return received_;
  }

 private:
  static sockaddr_in to(const char* address, std::uint16_t port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(port);
    inet_pton(AF_INET, address, &at.sin_addr);
    return at;
  }
  int socket_ = -1, received_ = 0;
};

/// What the third party is sent until whoever named its own address was sent ten datagrams, or the
/// third party itself was. -1 if the one at its own address never was.
int sent_to_a_third_party(const char* guard) {
  const std::uint32_t domain = settings().domain;
  const Victim victim(guard, domain, "", TwoHosts::ours());
  HostSocket enemy(TwoHosts::ours()), third(TwoHosts::theirs());
  const auto port = static_cast<std::uint16_t>(7400 + 250 * domain + 10);
  const auto named = [](std::uint8_t who, std::initializer_list<const char*> addresses) {
    Rtps::Prefix prefix = Rtps::kMe;
    prefix[4] = who;
    Datagram more;
    for (const char* address : addresses)
      more = Rtps::cat({more, Rtps::parameter(0x32, Rtps::locator(address, kPort)),
                        Rtps::parameter(0x31, Rtps::locator(address, kPort))});
    return Datagram(Rtps(prefix).data(
        Rtps::kSpdp, 1,
        Rtps::list({Rtps::parameter(0x15, {2, 3, 0, 0}), Rtps::parameter(0x16, {1, 15, 0, 0}),
                    Rtps::parameter(0x50, Rtps::guid(prefix, 0x1C1)), more,
                    Rtps::parameter(0x02, Rtps::cat({Rtps::u32(0x7FFFFFFF), Rtps::u32(0)})),
                    Rtps::parameter(0x58, Rtps::u32(0xC3F))})));
  };
  const bool heard = eventually([&] {
    enemy.send(named(1, {kTheirs}), kOurs, port);
    enemy.send(named(2, {kOurs, kTheirs}), kOurs, port);
    enemy.send(named(3, {kOurs}), kOurs, port);
    return enemy.received() >= 10;
  });
  (void)eventually([&] { return third.received() > 0 || std::string(guard) == "guarded"; });
  return heard ? third.received() : -1;
}

TEST(ThirdParty, IsSentNothingForWhoNamesItsAddress) {
  const TwoHosts hosts;
  if (!hosts.works()) GTEST_SKIP() << "network namespaces need root";
  EXPECT_GT(sent_to_a_third_party("bare"), 0) << "nobody is flooded without the guard either";
  EXPECT_EQ(sent_to_a_third_party("guarded"), 0);
}

}  // namespace
}  // namespace crane::test
