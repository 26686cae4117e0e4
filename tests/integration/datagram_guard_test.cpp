// SPDX-License-Identifier: Apache-2.0
// One malformed datagram ends Debian's Fast DDS. The guard before it lets through all that real
// peers send, and nothing that ends, hangs or fills a process.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <map>

#include "../rtps/capture.hpp"
#include "../rtps/mutate.hpp"
#include "../rtps/variants.hpp"
#include "domain.hpp"
#include "rtps_guard/guard.hpp"
#include "temp_folder.hpp"
#include "victim.hpp"

namespace crane::dds {
namespace {

using namespace std::chrono_literals;
using guard::Guard;
using guard::Refusal;
using guard::Verdict;
using test::Attacker;
using test::Captured;
using test::Datagram;
using test::eventually;
using test::Friend;
using test::Mutator;
using test::Rtps;
using test::Victim;

constexpr const char* kNoCapture = "capturing on loopback needs CAP_NET_RAW";
constexpr guard::Ipv4 kLoopback = 0x7F000001;

Refusal check(Guard& guard, const Datagram& d, guard::Ipv4 source = kLoopback) {
  Verdict verdict;
  guard.check(d, source, guard::Clock::now(), verdict);
  return verdict.refusal;
}

/// Frames (unkeyed, fragmented), tiles and commands (keyed), disposal, late joiners, over UDP.
std::vector<Captured> real_traffic() {
  test::Capture capture;
  if (!capture.works()) return {};
  const Settings settings = test::settings(test::Transport::kUdp);
  auto a = *Participant::create(settings, "a");
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
  auto b = *Participant::create(settings, "b");
  auto tiles_in = *Reader<MapTileTopic>::create(b, nullptr);
  auto frames_in = *Reader<StereoFrameTopic>::create(b, nullptr);
  auto commands_out = *Writer<ZoneCommandTopic>::create(b);
  int got = 0;
  EXPECT_TRUE(eventually([&] {
    while (tiles_in.take()) ++got;
    return got >= 40 && frames.matched() == 1 && commands_out.matched() == 1;
  }));
  auto frame = std::make_unique<StereoFrame>();
  frame->encoding(1);
  frame->width(64);
  frame->height(64);
  frame->exposure_time_ns(1);
  frame->left().resize(2'764'800);  // large: it goes in fragments
  frame->right().resize(2'764'800);
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
  return capture.take(settings.domain);
}

std::vector<Datagram> bytes_of(const std::vector<Captured>& all) {
  std::vector<Datagram> out;
  for (const Captured& c : all) out.push_back(c.bytes);
  return out;
}

/// The one of which it is known that it ends an unguarded process: statistics with four bytes more.
std::vector<Datagram> deadly() {
  std::vector<Datagram> out;
  for (int length = 40; length < 80; ++length)
    out.push_back(Rtps().add(0x80, 0, Datagram(std::size_t(length) + 4, 0), length));
  return out;
}

TEST(DatagramGuard, LetsThroughWhatRealPeersSendAndRefusesTheDatagramThatEndsThem) {
  const std::vector<Captured> traffic = real_traffic();
  if (traffic.empty()) GTEST_SKIP() << kNoCapture;
  std::map<int, int> kinds;
  Guard guard;
  for (const Captured& c : traffic) {
    const Refusal refusal = check(guard, c.bytes, c.source);
    ASSERT_EQ(refusal, Refusal::kNone)
        << text(refusal) << ", of " << c.bytes.size() << " bytes to port " << c.port;
    guard::MessageWalk walk(c.bytes);
    for (guard::Submessage s; walk.next(s);) ++kinds[s.id];
  }
  EXPECT_GT(traffic.size(), 200U);
  for (const int kind : {0x06, 0x07, 0x09, 0x0E, 0x15, 0x16, 0x80})
    EXPECT_GT(kinds[kind], 0) << "submessage " << kind;
  for (const Datagram& d : deadly()) EXPECT_EQ(check(guard, d), Refusal::kStatistics);
  Guard another;
  for (const Captured& c : traffic) {
    const Refusal refusal = check(another, test::big_endian(c.bytes), c.source);
    ASSERT_EQ(refusal, Refusal::kNone) << "big-endian: " << text(refusal);
  }
}

TEST(DatagramGuard, ReadsNothingBeyondTheEndWhateverIsCutOrFlipped) {
  const std::vector<Datagram> traffic = bytes_of(real_traffic());
  if (traffic.empty()) GTEST_SKIP() << kNoCapture;
  Guard guard;
  std::size_t refused = 0, all = 0;
  for (std::size_t n = 0; n < traffic.size(); n += 1 + traffic.size() / 60) {
    const Datagram& d = traffic[n];
    const std::size_t head = std::min<std::size_t>(d.size(), 600);
    for (std::size_t size = 0; size < head; ++size) {
      // Memory of its own: a sanitizer sees a byte too many.
      const Datagram cut(d.begin(), d.begin() + std::ptrdiff_t(size));
      refused += check(guard, cut) != Refusal::kNone ? 1 : 0;
      ++all;
    }
    for (std::size_t bit = 0; bit < 8 * head; ++bit) {
      Datagram flipped(d.begin(), d.end());
      flipped[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      refused += check(guard, flipped) != Refusal::kNone ? 1 : 0;
      ++all;
    }
  }
  Mutator mutator(traffic, 3);
  std::size_t mutated = 0;
  for (int i = 0; i < 100'000; ++i)
    mutated += check(guard, mutator.next()) != Refusal::kNone ? 1 : 0;
  EXPECT_GT(all, 20'000U);
  EXPECT_GT(refused, 10'000U);
  EXPECT_GT(mutated, 10'000U);
  EXPECT_LT(mutated, 99'000U) << "some must be let through, or nothing is tried";
}

constexpr std::uint32_t kDomain = 30;

TEST(DatagramGuard, WithoutItOneDatagramEndsAProcess) {
  Victim victim("bare", kDomain);
  ASSERT_TRUE(victim.alive());
  Attacker attacker(kDomain);
  for (const Datagram& d : deadly()) attacker.send_everywhere(d);
  EXPECT_TRUE(eventually([&] { return !victim.alive(); }) && WIFSIGNALED(victim.status()))
      << "this Fast DDS withstands it: the guard may be simplified";
}

TEST(DatagramGuard, NoKindOfDatagramThatIsKnownToEndHangOrFillAProcessDoesSo) {
  Victim victim("guarded", kDomain + 1);
  ASSERT_TRUE(Friend(kDomain + 1).is_served());
  const long before = victim.resident_mb();
  Attacker attacker(kDomain + 1);
  for (const Datagram& d : deadly()) attacker.send_everywhere(d);
  // Two readers of the same length.
  Datagram apart = Rtps().add(0x90, 0, Datagram(5, 0));
  apart.insert(apart.end(), {0x90, 0, 0, 0x80, 1, 56, 0});
  apart.resize(157, 0);
  attacker.send_everywhere(apart);
  // Counts of a token.
  const auto token = Rtps::cat({Rtps::string("DDS"), Rtps::u32(0xFFFFFFFF)});
  attacker.send_everywhere(Rtps().announce(10, "127.0.0.1", Rtps::parameter(0x1001, token)));
  // Numbers that are walked, by somebody who is believed.
  attacker.send_everywhere(Rtps().announce());
  std::this_thread::sleep_for(300ms);
  for (std::uint32_t n = 1; n <= 3; ++n)
    for (const std::uint32_t writer :
         {Rtps::kPublications, Rtps::kSubscriptions, Rtps::kLiveliness}) {
      attacker.send_everywhere(Rtps().heartbeat(writer, 1ULL << 60U, 1ULL << 60U, n));
      attacker.send_everywhere(Rtps().gap(writer, 2, 1U << 24U));
    }
  // Samples that are waited for.
  for (std::uint64_t n = 1; n < 200; ++n)
    attacker.send_everywhere(Rtps().fragment(Rtps::kPublications, n, 1, 8, 32U << 20U, 8));
  ASSERT_TRUE(victim.alive());
  EXPECT_TRUE(Friend(kDomain + 1).is_served());
  EXPECT_TRUE(victim.alive());
  EXPECT_LT(victim.resident_mb() - before, 60);
}

/// Mutations of what the victim and a client of it say to each other, in their names.
void live_through_mutations(std::uint32_t domain, const std::string& security, long count) {
  test::Capture capture;
  if (!capture.works()) GTEST_SKIP() << kNoCapture;
  Victim victim("guarded", domain, security);
  std::vector<Datagram> traffic;
  Friend client(domain, security);
  {
    ASSERT_TRUE(client.is_served());
    auto frame = std::make_unique<StereoFrame>();
    frame->encoding(1);
    frame->width(64);
    frame->height(64);
    frame->exposure_time_ns(1);
    frame->left().resize(2'764'800);  // large: it goes in fragments
    frame->right().resize(2'764'800);
    for (int i = 0; client.frames && i < 3; ++i) EXPECT_TRUE(client.frames->write(*frame));
    Friend leaves(domain, security);
    ASSERT_TRUE(leaves.is_served());
  }
  std::this_thread::sleep_for(300ms);
  traffic = bytes_of(capture.take(domain));
  // What is large is of few kinds: less of it.
  std::map<std::pair<int, std::size_t>, int> alike;
  std::erase_if(traffic, [&](const Datagram& d) {
    return d.size() > 3000 && ++alike[{d[20], d.size() / 1000}] > 3;
  });
  ASSERT_GT(traffic.size(), 100U);
  const long before = victim.resident_mb();
  Attacker attacker(domain);
  for (Datagram& d : test::variants(traffic, 4)) traffic.push_back(std::move(d));
  for (std::size_t i = 0; i < traffic.size(); ++i) attacker.send(traffic[i]);
  Mutator mutator(traffic, 4);
  for (long i = 1; i <= count && (i % 1000 != 0 || victim.alive()); ++i) {
    attacker.send(mutator.next());
    if (i % 100'000 != 0) continue;
    Friend newcomer(domain, security);
    ASSERT_TRUE(newcomer.is_served()) << "after " << i << " datagrams: " << newcomer.lacks();
    std::cout << i << " datagrams: " << victim.resident_mb() << " MB" << std::endl;
    ASSERT_LT(victim.resident_mb() - before, 200) << "after " << i << " datagrams";
  }
  ASSERT_TRUE(victim.alive()) << "the process ended";
  EXPECT_TRUE(Friend(domain, security).is_served());
  EXPECT_LT(victim.resident_mb() - before, 200);
  std::cout << "memory " << before << " MB, then " << victim.resident_mb() << " MB\n";
}

/// CRANEMAP_DATAGRAMS=5000000 for the long run.
long datagrams(long usual) {
  const char* wanted = std::getenv("CRANEMAP_DATAGRAMS");
  return wanted != nullptr ? std::atol(wanted) : usual;
}

TEST(DatagramGuard, AProcessLivesAndDeliversThroughMutatedTraffic) {
  live_through_mutations(kDomain + 2, "", datagrams(150'000));
}

TEST(DatagramGuard, AProcessLivesAndDeliversThroughMutatedTrafficWithSecurity) {
  const test::TempFolder folder;
  const std::string security = folder.path() / "security";
  const std::string make = std::string(CRANEMAP_SOURCE_DIR "/deploy/security/make ") + security +
                           " --domain " + std::to_string(kDomain + 3) +
                           " mapper operator > /dev/null 2>&1";
  ASSERT_EQ(std::system(make.c_str()), 0) << make;
  live_through_mutations(kDomain + 3, security, datagrams(100'000));
}

}  // namespace
}  // namespace crane::dds
