// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <netinet/ip.h>
#include <netinet/udp.h>
#include <netpacket/packet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <vector>

#include "build.hpp"

namespace crane::test {

struct Captured {
  Datagram bytes;
  std::uint32_t source = 0;
  std::uint16_t port = 0;  ///< to which
};

/// RTPS datagrams as they pass the loopback interface. Needs CAP_NET_RAW.
class Capture {
 public:
  Capture() : socket_(::socket(AF_PACKET, SOCK_DGRAM, htons(ETH_P_IP))) {
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(ETH_P_IP);
    address.sll_ifindex = static_cast<int>(if_nametoindex("lo"));
    if (socket_ >= 0 && bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      close(socket_);
      socket_ = -1;
    }
    const int size = 64 << 20;
    if (socket_ >= 0) setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size);
  }
  ~Capture() {
    if (socket_ >= 0) close(socket_);
  }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;
  [[nodiscard]] bool works() const { return socket_ >= 0; }

  /// What came since the last call, of one domain's ports.
  std::vector<Captured> take(std::uint32_t domain) {
    std::vector<Captured> out;
    Datagram packet(70'000);
    for (;;) {
      const ssize_t size = recv(socket_, packet.data(), packet.size(), MSG_DONTWAIT);
      if (size <= 0) return out;
      if (size < 28 || packet[9] != IPPROTO_UDP) continue;
      const std::size_t ip = std::size_t(packet[0] & 15U) * 4, header = ip + 8;
      if (std::size_t(size) < header + 20) continue;
      Captured c;
      c.bytes.assign(packet.begin() + std::ptrdiff_t(header), packet.begin() + size);
      for (int i = 0; i < 4; ++i) c.source = c.source << 8U | packet[12 + std::size_t(i)];
      c.port = static_cast<std::uint16_t>(packet[ip + 2] << 8U | packet[ip + 3]);
      const std::uint32_t first = 7400 + 250 * domain;
      if (c.port < first || c.port >= first + 250) continue;
      if (c.bytes[0] == 'R' && c.bytes[1] == 'T' && c.bytes[2] == 'P' && c.bytes[3] == 'S')
        out.push_back(std::move(c));
    }
  }

 private:
  int socket_;
};

}  // namespace crane::test
