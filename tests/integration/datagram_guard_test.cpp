// One malformed datagram ends Debian's Fast DDS. The check before it lets through all that real
// peers send, and nothing that ends a process.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <netinet/ip.h>
#include <netinet/udp.h>
#include <netpacket/packet.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <cstdlib>
#include <map>
#include <random>
#include <set>

#include "dds/rtps_check.hpp"
#include "domain.hpp"

namespace crane::dds {
namespace {

using namespace std::chrono_literals;
using test::eventually;
using Datagram = std::vector<std::uint8_t>;

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
  [[nodiscard]] bool works() const { return socket_ >= 0; }

  std::vector<Datagram> take() {
    std::vector<Datagram> out;
    Datagram packet(70'000);
    for (;;) {
      const ssize_t size = recv(socket_, packet.data(), packet.size(), MSG_DONTWAIT);
      if (size <= 0) return out;
      if (size < 28 || packet[9] != IPPROTO_UDP) continue;
      const std::size_t header = std::size_t(packet[0] & 15U) * 4 + 8;
      if (std::size_t(size) < header + 20) continue;
      Datagram d(packet.begin() + std::ptrdiff_t(header), packet.begin() + size);
      if (d[0] == 'R' && d[1] == 'T' && d[2] == 'P' && d[3] == 'S') out.push_back(std::move(d));
    }
  }

 private:
  int socket_;
};

/// Frames (unkeyed, fragmented), tiles and commands (keyed), disposal, late joiners, over UDP.
std::vector<Datagram> real_traffic() {
  Capture capture;
  if (!capture.works()) return {};
  auto a = *Participant::create(test::settings(Transport::kUdp), "a");
  auto tiles = *Writer<MapTileTopic>::create(a);
  auto frames = *Writer<StereoFrameTopic>::create(a);
  auto commands = *Reader<ZoneCommandTopic>::create(a, nullptr);
  v1::MapTile tile;
  tile.crane(1);
  tile.voxel_m(0.05);
  tile.encoding(1);
  tile.payload(std::vector<std::uint8_t>(50'000, 7));
  for (int i = 0; i < 40; ++i) {
    tile.tile_x(static_cast<std::int16_t>(i));
    EXPECT_TRUE(tiles.write(tile));
  }
  auto b = *Participant::create(test::settings(Transport::kUdp), "b");
  auto tiles_in = *Reader<MapTileTopic>::create(b, nullptr);
  auto frames_in = *Reader<StereoFrameTopic>::create(b, nullptr);
  auto commands_out = *Writer<ZoneCommandTopic>::create(b);
  int got = 0;
  EXPECT_TRUE(eventually([&] {
    while (tiles_in.take()) ++got;
    return got >= 40 && frames.matched() == 1 && commands_out.matched() == 1;
  }));
  auto frame = std::make_unique<v1::StereoFrame>();
  frame->encoding(1);
  frame->width(64);
  frame->height(64);
  frame->exposure_time_ns(1);
  v1::ZoneCommand command;
  command.crane(1);
  command.action(v1::ZONE_SWITCH);
  command.zone().id(3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(frames.write(*frame));
    EXPECT_TRUE(commands_out.write(command));
    tile.tile_x(static_cast<std::int16_t>(i));
    EXPECT_TRUE(tiles.dispose(tile));
    std::this_thread::sleep_for(100ms);
  }
  bool frame_came = false;
  EXPECT_TRUE(eventually([&] {
    while (frames_in.take()) frame_came = true;
    return frame_came;
  }));
  EXPECT_EQ(a->refused_datagrams(), 0U);
  EXPECT_EQ(b->refused_datagrams(), 0U);
  return capture.take();
}

/// Header, then one submessage.
Datagram datagram(std::uint8_t id, std::uint8_t flags, Datagram body, int length = -1) {
  Datagram d = {'R', 'T', 'P', 'S', 2, 2, 1, 15, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  const std::size_t size = length < 0 ? body.size() : static_cast<std::size_t>(length);
  d.insert(d.end(), {id, flags, std::uint8_t(size & 255U), std::uint8_t(size >> 8U)});
  d.insert(d.end(), body.begin(), body.end());
  return d;
}

Datagram words(std::initializer_list<std::uint32_t> values) {
  Datagram out;
  for (const std::uint32_t v : values)
    for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
  return out;
}

/// The one of which it is known that it ends an unguarded process: statistics with four bytes more.
std::vector<Datagram> deadly() {
  std::vector<Datagram> out;
  for (int length = 40; length < 80; ++length)
    out.push_back(datagram(0x80, 1, Datagram(std::size_t(length) + 4, 0), length));
  return out;
}

Datagram mutate(const std::vector<Datagram>& corpus, std::mt19937& random) {
  Datagram d = corpus[random() % corpus.size()];
  for (unsigned n = 1U << random() % 5; n > 0 && d.size() > 20; --n) {
    const std::size_t at =
        random() % 10 == 0 ? random() % d.size() : 20 + random() % (d.size() - 20);
    switch (random() % 5) {
      case 0:
        d[at] = static_cast<std::uint8_t>(random());
        break;
      case 1:
        d[at] ^= static_cast<std::uint8_t>(1U << random() % 8);
        break;
      case 2: {
        static constexpr std::uint32_t kNasty[] = {0, 0xFFFFFFFF, 0x80000000, 0x7FFFFFFF,
                                                   0xFFFFFFF0};
        const std::uint32_t value = kNasty[random() % 5];
        for (std::size_t i = 0; i < 4 && at + i < d.size(); ++i)
          d[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
        break;
      }
      case 3:
        d.resize(20 + random() % (d.size() - 20));
        break;
      default:
        d.insert(d.begin() + std::ptrdiff_t(at), random() % 64, std::uint8_t(random()));
    }
  }
  if (d.size() > 65'000) d.resize(65'000);
  return d;
}

/// guard_victim.cpp, a process of its own.
pid_t victim(const char* guard, std::uint32_t domain) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  const std::string program = CRANEMAP_BIN_DIR "/guard_victim";
  execl(program.c_str(), program.c_str(), std::to_string(domain).c_str(), guard, nullptr);
  _exit(127);
}

bool alive(pid_t pid) {
  return waitpid(pid, nullptr, WNOHANG) == 0;
}

/// To the ports that participants of a domain listen to.
class Attacker {
 public:
  explicit Attacker(std::uint32_t domain) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    for (const std::uint32_t offset : {0U, 10U, 11U, 12U, 13U, 14U, 15U})  // DDSI-RTPS 9.6.1
      ports_.push_back(static_cast<std::uint16_t>(7400 + 250 * domain + offset));
  }
  ~Attacker() { close(socket_); }
  void send(const Datagram& d) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(ports_[next_++ % ports_.size()]);
    (void)sendto(socket_, d.data(), d.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
    if (next_ % 200 == 0) std::this_thread::sleep_for(4ms);
  }
  void send_everywhere(const Datagram& d) {
    for (std::size_t i = 0; i < ports_.size(); ++i) send(d);
  }

 private:
  int socket_;
  std::vector<std::uint16_t> ports_;
  std::size_t next_ = 0;
};

constexpr std::uint32_t kDomain = 30;

TEST(RtpsCheck, LetsThroughWhatRealPeersSendAndRefusesTheDatagramThatEndsThem) {
  const std::vector<Datagram> traffic = real_traffic();
  if (traffic.empty()) GTEST_SKIP() << "capturing on loopback needs CAP_NET_RAW";
  std::map<int, int> kinds;
  RtpsCheck check;
  for (const Datagram& d : traffic) {
    ASSERT_EQ(rtps_flaw(d), nullptr) << "of " << d.size() << " bytes";
    ASSERT_EQ(check.flaw(d), nullptr);
    for (std::size_t at = 20; at + 4 <= d.size();) {
      ++kinds[d[at]];
      const std::size_t length = d[at + 2] | d[at + 3] << 8U;
      if (d[at] == 0x80 || length == 0) break;
      at += 4 + length;
    }
  }
  EXPECT_GT(traffic.size(), 200U);
  for (const int kind : {0x06, 0x07, 0x09, 0x0E, 0x15, 0x16, 0x80})
    EXPECT_GT(kinds[kind], 0) << "submessage " << kind;
  int sound = 0;
  for (const Datagram& d : deadly()) sound += rtps_flaw(d) == nullptr ? 1 : 0;
  EXPECT_EQ(sound, 0);
}

TEST(RtpsCheck, ReadsNothingBeyondTheEndWhateverIsCutOrFlipped) {
  const std::vector<Datagram> traffic = real_traffic();
  if (traffic.empty()) GTEST_SKIP() << "capturing on loopback needs CAP_NET_RAW";
  RtpsCheck check;
  std::size_t refused = 0, all = 0;
  for (std::size_t n = 0; n < traffic.size(); n += 1 + traffic.size() / 60) {
    const Datagram& d = traffic[n];
    const std::size_t head = std::min<std::size_t>(d.size(), 600);
    for (std::size_t size = 0; size < head; ++size) {
      // Memory of its own: a sanitizer sees a byte too many.
      const Datagram cut(d.begin(), d.begin() + std::ptrdiff_t(size));
      refused += check.flaw(cut) != nullptr ? 1 : 0;
      ++all;
    }
    for (std::size_t bit = 0; bit < 8 * head; ++bit) {
      Datagram flipped(d.begin(), d.end());
      flipped[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      refused += check.flaw(flipped) != nullptr ? 1 : 0;
      ++all;
    }
  }
  std::mt19937 random(3);
  for (int i = 0; i < 100'000; ++i)
    refused += check.flaw(mutate(traffic, random)) != nullptr ? 1 : 0;
  EXPECT_GT(all, 20'000U);
  EXPECT_GT(refused, 10'000U);
}

TEST(RtpsCheck, RefusesWhatBreaksEachRule) {
  const auto flaw = [](std::uint8_t id, const Datagram& body) {
    return std::string(
        rtps_flaw(datagram(id, 1, body)) != nullptr ? rtps_flaw(datagram(id, 1, body)) : "sound");
  };
  // reader, writer, base 0:5, 32 bits, bitmap, count
  EXPECT_EQ(flaw(0x06, words({1, 2, 0, 5, 32, 0, 1})), "sound");
  EXPECT_NE(flaw(0x06, words({1, 2, 0, 5, 300, 0, 1})), "sound");
  EXPECT_NE(flaw(0x06, words({1, 2, 0, 5, 64, 0, 1})), "sound");
  EXPECT_EQ(flaw(0x07, words({1, 2, 0, 5, 0, 9, 1})), "sound");
  EXPECT_NE(flaw(0x07, words({1, 2, 0, 9, 0, 5, 1})), "sound") << "last before first";
  EXPECT_EQ(flaw(0x08, words({1, 2, 0, 5, 0, 9, 0})), "sound");
  EXPECT_NE(flaw(0x08, words({1, 2, 0, 5, 0x7FFFFFFF, 9, 0})), "sound") << "an endless gap";
  EXPECT_NE(flaw(0x08, words({1, 2, 0, 5, 0, 4, 0})), "sound");
  // DATA_FRAG: offset 28, reader, writer, 0:5, first 1, one of 16 bytes, sample of 64
  const auto fragment = [&](std::uint32_t first, std::uint32_t count_and_size,
                            std::uint32_t sample) {
    Datagram d = words({0x001C0000, 1, 2, 0, 5, first, count_and_size, sample, 1, 2, 3, 4});
    return flaw(0x16, d);
  };
  EXPECT_EQ(fragment(1, 0x00100001, 64), "sound");
  EXPECT_NE(fragment(0, 0x00100001, 64), "sound");
  EXPECT_NE(fragment(9, 0x00100001, 64), "sound") << "beyond the sample";
  EXPECT_NE(fragment(1, 0x00100002, 64), "sound") << "shorter than it says";
  EXPECT_NE(fragment(1, 0x00100001, 0x7FFFFFFF), "sound") << "no topic has such samples";
  EXPECT_NE(flaw(0x42, words({1, 2, 3})), "sound");
  RtpsCheck check;
  Datagram one = datagram(0x16, 1, words({0x001C0000, 1, 2, 0, 5, 1, 0x00100001, 64, 1, 2, 3, 4}));
  Datagram other = datagram(0x16, 1, words({0x001C0000, 1, 2, 0, 5, 2, 0x00080001, 64, 1, 2}));
  EXPECT_EQ(check.flaw(one), nullptr);
  EXPECT_EQ(rtps_flaw(other), nullptr);
  EXPECT_NE(check.flaw(other), nullptr) << "two sizes of fragments of one sample";
}

TEST(RtpsCheck, LetsNewParticipantsThroughOnlySoManyAtOnceAndKnownOnesAlways) {
  const auto announcement = [](std::uint32_t who) {
    // INFO-less DATA(p) with an empty parameter list, from a prefix of its own.
    Datagram d =
        datagram(0x15, 5, words({0x00100000, 0xC7000100, 0xC2000100, 0, 1, 0x00000300, 1}));
    for (int i = 0; i < 4; ++i) d[8 + i] = static_cast<std::uint8_t>(who >> (8 * i));
    return d;
  };
  RtpsCheck check;
  EXPECT_EQ(check.flaw(announcement(0)), nullptr) << check.flaw(announcement(0));
  std::uint32_t passed = 1;
  for (std::uint32_t who = 1; who < 2000; ++who)
    if (check.flaw(announcement(who)) == nullptr) ++passed;
  EXPECT_GE(passed, std::uint32_t(RtpsCheck::kNewcomersAtOnce));
  EXPECT_LT(passed, std::uint32_t(RtpsCheck::kNewcomersAtOnce) + 100);
  EXPECT_EQ(check.flaw(announcement(0)), nullptr) << "it was there before the flood";
}

TEST(DatagramGuard, WithoutItOneDatagramEndsAProcess) {
  const pid_t pid = victim("bare", kDomain);
  std::this_thread::sleep_for(500ms);
  ASSERT_TRUE(alive(pid));
  Attacker attacker(kDomain);
  for (const Datagram& d : deadly()) attacker.send_everywhere(d);
  int status = 0;
  const bool ended = eventually([&] { return waitpid(pid, &status, WNOHANG) == pid; });
  if (!ended) kill(pid, SIGKILL), waitpid(pid, &status, 0);
  EXPECT_TRUE(ended && WIFSIGNALED(status))
      << "this Fast DDS withstands it: the guard may be simplified";
}

TEST(DatagramGuard, WithItAProcessLivesAndDeliversThroughMutatedTraffic) {
  std::vector<Datagram> traffic = real_traffic();
  if (traffic.empty()) GTEST_SKIP() << "capturing on loopback needs CAP_NET_RAW";
  const std::uint32_t domain = kDomain + 1;
  const pid_t pid = victim("guarded", domain);
  std::this_thread::sleep_for(500ms);
  Attacker attacker(domain);
  for (const Datagram& d : deadly()) attacker.send_everywhere(d);
  // 150,000 here; CRANEMAP_DATAGRAMS=5000000 for the long run.
  const char* wanted = std::getenv("CRANEMAP_DATAGRAMS");
  const long count = wanted != nullptr ? std::atol(wanted) : 150'000;
  std::mt19937 random(4);
  for (long i = 0; i < count && (i % 1000 != 0 || alive(pid)); ++i)
    attacker.send(mutate(traffic, random));
  EXPECT_TRUE(alive(pid)) << "the process ended";
  // It still serves: a late joiner gets all tiles, a command is answered.
  Settings settings;
  settings.domain = domain;
  settings.transport = Transport::kUdp;
  auto participant = *Participant::create(settings, "friend");
  auto tiles = *Reader<MapTileTopic>::create(participant, nullptr);
  auto zones = *Reader<ZoneSetTopic>::create(participant, nullptr);
  auto commands = *Writer<ZoneCommandTopic>::create(participant);
  v1::ZoneCommand command;
  command.crane(1);
  command.action(v1::ZONE_SWITCH);
  command.zone().id(3);
  std::set<int> seen;
  bool answered = false;
  const auto delivers = [&] {
    (void)commands.write(command);
    while (const auto tile = tiles.take()) seen.insert((*tile)->tile_x());
    while (zones.take()) answered = true;
    return seen.size() >= 50 && answered;
  };
  // Announcements of peers that never were have made it busy: half a minute at most.
  EXPECT_TRUE(eventually(delivers) || eventually(delivers) || eventually(delivers))
      << seen.size() << " tiles, answered " << answered;
  kill(pid, SIGKILL);
  waitpid(pid, nullptr, 0);
}

}  // namespace
}  // namespace crane::dds
