// SPDX-License-Identifier: Apache-2.0
// Peers that speak well-formed RTPS and want no good. Whoever is served goes on being served, who
// comes later is served as well, and memory stays within bounds.

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <optional>

#include "../rtps/build.hpp"
#include "domain.hpp"
#include "victim.hpp"

namespace crane::test {
namespace {

constexpr std::uint32_t kReader = 0x00001207, kWriter = 0x00001202;
constexpr const char *kCommands = "crane/v1/zone_command", *kTiles = "crane/v1/map_tile";

Rtps::Prefix somebody(std::uint32_t who) {
  Rtps::Prefix prefix = Rtps::kMe;
  for (unsigned i = 0; i < 4; ++i) prefix[4 + i] = static_cast<std::uint8_t>(who >> (8 * i));
  return prefix;
}

/// Sends to the victim alone, which is the first participant of its domain, no faster than it
/// reads; takes what it is sent.
class Enemy {
 public:
  explicit Enemy(std::uint32_t domain)
      : socket_(::socket(AF_INET, SOCK_DGRAM, 0)),
        discovery_(static_cast<std::uint16_t>(7400 + 250 * domain + 10)) {
    const int size = 4 << 20;
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &size, sizeof size);
    sockaddr_in at = loopback(0);
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&at), sizeof at), 0);
    socklen_t length = sizeof at;
    EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&at), &length), 0);
    port_ = ntohs(at.sin_port);
  }
  ~Enemy() { close(socket_); }
  Enemy(const Enemy&) = delete;
  Enemy& operator=(const Enemy&) = delete;

  void tell(const Datagram& d) { send_to(d, discovery_); }
  void send(const Datagram& d) { send_to(d, static_cast<std::uint16_t>(discovery_ + 1)); }
  void announce(const Rtps::Prefix& prefix, std::uint32_t lease_s) {
    tell(Rtps(prefix).announce(lease_s, "127.0.0.1", {}, port_));
  }
  /// Known, with a reader and a writer that match the victim's.
  void join(const Rtps::Prefix& prefix = Rtps::kMe) {
    announce(prefix, 60);
    tell(Rtps(prefix).announce_endpoint(Rtps::kSubscriptions, 1, kReader, kTiles, "MapTile"));
    tell(Rtps(prefix).announce_endpoint(Rtps::kPublications, 1, kWriter, kCommands, "ZoneCommand"));
    wait_until_read();
  }
  void wait_until_read() {
    (void)eventually([this] {
      take();
      return unread(discovery_) == 0 && unread(discovery_ + 1) == 0;
    });
  }
  /// Sent to us so far: a lower bound.
  [[nodiscard]] std::size_t received_mb() {
    take();
    return received_ >> 20U;
  }

 private:
  static sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port = htons(port);
    return at;
  }
  void send_to(const Datagram& d, std::uint16_t port) {
    const sockaddr_in to = loopback(port);
    (void)sendto(socket_, d.data(), d.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    if (++sent_ % 64 == 0) wait_until_read();
  }
  void take() {
    char byte = 0;
    for (ssize_t n = 0; (n = recv(socket_, &byte, 1, MSG_DONTWAIT | MSG_TRUNC)) >= 0;)
      received_ += std::size_t(n);
  }
  /// Bytes that wait in whatever socket has this port.
  static std::size_t unread(std::uint32_t port) {
    std::ifstream table("/proc/net/udp");
    std::string line;
    std::getline(table, line);
    std::size_t sum = 0;
    unsigned at = 0, queued = 0;
    while (std::getline(table, line))
      if (std::sscanf(line.c_str(), " %*d: %*x:%x %*x:%*x %*x %*x:%x", &at, &queued) == 2 &&
          at == port)
        sum += queued;
    return sum;
  }

  int socket_;
  std::uint16_t discovery_, port_ = 0;
  std::size_t sent_ = 0, received_ = 0;
};

/// `early`: before anybody else has come.
void live_through(const std::function<void(Enemy&)>& attack, bool early = false) {
  const std::uint32_t domain = settings().domain;
  Victim victim("guarded", domain);
  std::optional<Friend> client;
  if (!early) {
    client.emplace(domain);
    ASSERT_TRUE(client->is_served()) << client->lacks();
  }
  const long before = victim.resident_mb();
  Enemy enemy(domain);
  attack(enemy);
  EXPECT_TRUE(!client || client->is_served()) << client->lacks();
  Friend newcomer(domain);
  EXPECT_TRUE(newcomer.is_served()) << newcomer.lacks();
  EXPECT_TRUE(victim.alive());
  EXPECT_LT(victim.resident_mb() - before, 80);
  EXPECT_LT(enemy.received_mb(), 100U) << "all 50 tiles, 150 kB, for each time that it comes";
  std::cout << "memory " << victim.resident_mb() - before << " MB, sent to the enemy "
            << enemy.received_mb() << " MB\n";
}

TEST(HostilePeers, ThousandsOfEndpointsOfOneParticipant) {
  live_through([](Enemy& enemy) {
    enemy.join();
    for (std::uint32_t n = 2; n < 6000; ++n) {
      enemy.tell(
          Rtps().announce_endpoint(Rtps::kSubscriptions, n, n << 8U | 7U, kTiles, "MapTile"));
      enemy.tell(
          Rtps().announce_endpoint(Rtps::kPublications, n, n << 8U | 2U, kCommands, "ZoneCommand"));
    }
  });
}

TEST(HostilePeers, ThousandsOfParticipantsAtOneAddress) {
  live_through([](Enemy& enemy) {
    for (std::uint32_t who = 0; who < 4000; ++who) {
      enemy.join(somebody(who));
      for (std::uint32_t n = 2; n < 12; ++n)
        enemy.tell(
            Rtps(somebody(who))
                .announce_endpoint(Rtps::kSubscriptions, n, n << 8U | 7U, kTiles, "MapTile"));
    }
  });
}

/// Each time the victim makes it anew, and sends it all tiles.
TEST(HostilePeers, WhoComesAndGoesAllTheTime) {
  live_through([](Enemy& enemy) {
    enemy.join();
    for (std::uint32_t n = 2; n < 8000; n += 2) {
      enemy.tell(Rtps().end(Rtps::kSubscriptions, n, kReader, std::uint8_t(n % 3 + 1)));
      enemy.tell(Rtps().announce_endpoint(Rtps::kSubscriptions, n + 1, kReader, kTiles, "MapTile"));
    }
    for (std::uint32_t n = 2; n < 2000; n += 2) {
      enemy.tell(Rtps().end(Rtps::kSpdp, n, 0x1C1, std::uint8_t(n % 3 + 1)));
      enemy.join();
    }
  });
}

/// With a lease of no time it is gone at once, and made anew by each word.
TEST(HostilePeers, LeasesOfNoTime) {
  live_through([](Enemy& enemy) {
    for (std::uint32_t n = 1; n < 8000; ++n) enemy.announce(somebody(n % 100), 0);
  });
}

TEST(HostilePeers, AFloodOfSignsOfLife) {
  live_through([](Enemy& enemy) {
    enemy.join();
    for (std::uint32_t n = 1; n < 20'000; ++n)
      enemy.tell(Rtps().alive(n, std::uint8_t(n % 3), n % 10 == 0 ? 4000 : n % 7));
  });
}

/// A reader that has never got anything, whatever is sent to it.
TEST(HostilePeers, AReaderThatAsksForEverythingAgainAndAgain) {
  live_through([](Enemy& enemy) {
    enemy.join();
    for (std::uint32_t n = 1; n < 20'000; ++n) {
      const std::uint32_t writer = (n % 4 + 1) << 8U | (n % 2 == 0 ? 2U : 3U);
      enemy.send(Rtps()
                     .acknack(kReader, writer, 1 + n % 50, 256, n)
                     .nack_frag(kReader, writer, n % 50 + 1, 1, 256, n)
                     .heartbeat_frag(kWriter, n, 0xFFFFFFFF, n));
      enemy.tell(Rtps()
                     .acknack(0x000003C7, Rtps::kPublications, 1, 256, n)
                     .acknack(0x000004C7, Rtps::kSubscriptions, 1, 256, n)
                     .acknack(0x000100C7, Rtps::kSpdp, 1, 256, n));
    }
  });
}

/// An instance for each key hash: there are sixteen of commands, none for a newcomer then.
TEST(HostilePeers, MoreKeysThanThereIsRoomFor) {
  live_through(
      [](Enemy& enemy) {
        for (std::uint32_t who = 0; who < 4; ++who) {
          enemy.join(somebody(who));
          for (std::uint32_t n = 1; n < 500; ++n)
            enemy.send(Rtps(somebody(who))
                           .data(kWriter, n, Rtps::cat({{0, 1, 0, 0}, Datagram(400, 1)}), 4,
                                 Rtps::cat({Rtps::parameter(0x70, Rtps::cat({Rtps::u32(n * 7 + who),
                                                                             Datagram(12, 0)})),
                                            {1, 0, 0, 0}})));
        }
      },
      true);
}

/// Numbers apart from each other: a reader keeps each until those between have come.
TEST(HostilePeers, SamplesOfWhichEveryOtherIsMissing) {
  live_through([](Enemy& enemy) {
    for (std::uint32_t who = 0; who < 8; ++who) {
      enemy.join(somebody(who));
      for (std::uint32_t n = 1; n < 2000; ++n) {
        Rtps many(somebody(who));
        for (std::uint32_t i = 0; i < 100; ++i)
          many.data(Rtps::kLiveliness, 2ULL * (n * 100 + i),
                    Rtps::cat({{0, 1, 0, 0},
                               Datagram(somebody(who).begin(), somebody(who).end()),
                               {0, 0, 0, 1},
                               Rtps::u32(0)}));
        enemy.tell(many);
      }
    }
  });
}

}  // namespace
}  // namespace crane::test
