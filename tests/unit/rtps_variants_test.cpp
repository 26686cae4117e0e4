// SPDX-License-Identifier: Apache-2.0
// Whoever says it, in whatever byte order: the guard reads the same.

#include <gtest/gtest.h>

#include <set>

#include "../rtps/variants.hpp"
#include "rtps_guard/guard.hpp"

namespace crane::guard {
namespace {

using test::Datagram;
using test::Rtps;
using namespace std::chrono_literals;

constexpr std::uint32_t kWriter = 0x00001203;

/// What a participant may say in its life, in this order; right and wrong.
std::vector<Datagram> life() {
  const auto announced = Rtps::cat(
      {Rtps::parameter(0x62, Rtps::string("name")),
       Rtps::parameter(0x59, Rtps::cat({Rtps::u32(1), Rtps::string("key"), Rtps::string("value")})),
       Rtps::parameter(0x32, Rtps::locator("10.9.8.7", 7410)),
       Rtps::parameter(0x75, Datagram(40, 1))});
  const auto token = Rtps::cat({Rtps::string("DDS"), Rtps::u32(0xFFFFFFFF)});
  return {Rtps().announce(5, "127.0.0.1", Rtps::parameter(0x1001, token)),
          Rtps().announce(0x7FFFFFFF, "127.0.0.1", announced),
          Rtps().announce(20, "10.1.1.1"),
          Rtps().announce_writer(kWriter, "crane/v1/map_tile"),
          Rtps().announce_endpoint(Rtps::kSubscriptions, 2, 0x00001304, "t", "T"),
          Rtps().heartbeat(kWriter, 1, 20, 1),
          Rtps().heartbeat(kWriter, 1ULL << 60U, 1ULL << 60U, 2),
          Rtps().heartbeat(kWriter, 9, 3, 3),
          Rtps().gap(kWriter, 30, 1ULL << 40U),
          Rtps().gap(kWriter, 2, 9),
          Rtps().acknack(0x00001304, kWriter, 7, 64, 1),
          Rtps().acknack(0x00001304, kWriter, 7, 257, 2),
          Rtps().nack_frag(0x00001304, kWriter, 7, 1, 32, 1),
          Rtps().heartbeat_frag(kWriter, 40, 3, 1),
          Rtps().fragment(kWriter, 40, 1, 8, 32U << 20U, 8),
          Rtps().fragment(kWriter, 41, 1, 1024, 4096, 1024),
          Rtps().fragment(kWriter, 41, 2, 2048, 4096, 2048),
          Rtps().alive(1, 1),
          Rtps().data(Rtps::kPublications, 9, Datagram{0, 7, 0, 0}),
          Rtps().end(Rtps::kSubscriptions, 3, 0x00001304),
          Rtps().end(Rtps::kSpdp, 2, 0x1C1)};
}

struct Seen {
  Refusal refusal = Refusal::kNone;
  std::set<std::size_t> changed;  ///< words of 4 bytes
  bool operator==(const Seen&) const = default;
};

std::vector<Seen> watch(const std::vector<Datagram>& said) {
  Guard guard;
  Clock::time_point now{1h};
  std::vector<Seen> out;
  for (const Datagram& d : said) {
    Verdict verdict;
    guard.check(d, 0x7F000001, now += 1ms, verdict);
    Seen seen{verdict.refusal, {}};
    Datagram patched = d;
    if (seen.refusal == Refusal::kNone) verdict.patches.apply(patched);
    for (std::size_t i = 0; i < d.size(); ++i)
      if (patched[i] != d[i]) seen.changed.insert(i / 4);
    out.push_back(seen);
  }
  return out;
}

TEST(RtpsVariants, TheGuardReadsTheSameInEitherByteOrderAndOfAnyVendor) {
  const std::vector<Datagram> said = life();
  const std::vector<Seen> seen = watch(said);
  std::set<Refusal> kinds;
  std::size_t changed = 0;
  for (const Seen& s : seen) {
    kinds.insert(s.refusal);
    changed += s.changed.size();
  }
  ASSERT_GE(kinds.size(), 8U) << "of what is refused, and of what is not";
  ASSERT_GE(changed, 5U);
  const auto other = [&](const auto& say) {
    std::vector<Datagram> out;
    for (const Datagram& d : said) out.push_back(say(d));
    return watch(out);
  };
  const auto turned = other(test::big_endian);
  const auto cyclones = other([](const Datagram& d) { return test::of_vendor(d, 0x0110); });
  for (std::size_t i = 0; i < said.size(); ++i) {
    EXPECT_EQ(text(turned[i].refusal), text(seen[i].refusal)) << "message " << i;
    EXPECT_EQ(turned[i].changed, seen[i].changed) << "message " << i;
    EXPECT_EQ(text(cyclones[i].refusal), text(seen[i].refusal)) << "message " << i;
  }
}

TEST(RtpsVariants, CutAtEveryByteNothingIsReadBeyondTheEndAndNoPatchLiesThere) {
  std::vector<Datagram> said = life();
  for (const Datagram& d : test::variants(said, 1)) said.push_back(d);
  std::size_t let_through = 0;
  for (const Datagram& d : said)
    for (std::size_t size = 0; size <= d.size(); ++size) {
      // Memory of its own: a sanitizer sees a byte too many.
      Datagram cut(d.begin(), d.begin() + std::ptrdiff_t(size));
      Guard guard;
      Verdict verdict;
      guard.check(Rtps().announce().bytes(), 0x7F000001, Clock::time_point{1h}, verdict);
      guard.check(cut, 0x7F000001, Clock::time_point{1h}, verdict);
      if (verdict.refusal != Refusal::kNone) continue;
      verdict.patches.apply(cut);
      ++let_through;
    }
  EXPECT_GT(let_through, said.size());
}

}  // namespace
}  // namespace crane::guard
