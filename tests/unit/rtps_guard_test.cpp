// SPDX-License-Identifier: Apache-2.0
// What the guard before Fast DDS refuses, and why; each kind that ended, hung or filled a service
// is here, with its neighbours.

#include "rtps_guard/guard.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>

#include "../rtps/build.hpp"

namespace crane::guard {

void PrintTo(Refusal refusal, std::ostream* out) {
  *out << text(refusal);
}

namespace {

using test::Datagram;
using test::Rtps;
using namespace std::chrono_literals;

constexpr Ipv4 kLoopback = 0x7F000001, kFar = 0x0A630005, kOther = 0x0A630006;
constexpr std::uint32_t kWriter = 0x00001203;

/// One guard and its clock.
struct Watch {
  explicit Watch(Options options = {}) : guard(std::move(options)) {}
  Refusal operator()(const Datagram& d, Ipv4 source = kLoopback) {
    guard.check(d, source, now, verdict);
    patched = d;
    if (verdict.refusal == Refusal::kNone) verdict.patches.apply(patched);
    return verdict.refusal;
  }
  Guard guard;
  Clock::time_point now{1h};
  Verdict verdict;
  Datagram patched;
};

Datagram pad(std::size_t bytes) {
  return Datagram(bytes, 0);
}

TEST(RtpsGuard, WalksWhereFastDdsWalksAndRefusesLengthsThatTheTwoCouldReadDifferently) {
  Watch watch;
  EXPECT_EQ(watch(Rtps()), Refusal::kNone);
  EXPECT_EQ(watch(pad(19)), Refusal::kHeader);
  EXPECT_EQ(watch(pad(64)), Refusal::kHeader);
  // An own submessage of 5 bytes: one reader goes on at 5, the other at 8.
  EXPECT_EQ(watch(Rtps(Rtps::kMe, 0x0110).add(0x90, 0, pad(8), 5)), Refusal::kUnaligned);
  EXPECT_EQ(watch(Rtps(Rtps::kMe, 0x0110).add(0x90, 0, pad(5))), Refusal::kNone) << "the last one";
  EXPECT_EQ(watch(Rtps().add(0x90, 0, pad(8))), Refusal::kUnknownSubmessage)
      << "none of Fast DDS's";
  for (int length = 40; length < 80; ++length)
    EXPECT_EQ(watch(Rtps().add(0x80, 0, pad(60), length)), Refusal::kStatistics) << length;
  EXPECT_EQ(watch(Rtps().add(0x80, 0, pad(56))), Refusal::kNone);
  EXPECT_EQ(watch(Rtps().add(0x80, 0, pad(56)).add(1, 0, {})), Refusal::kStatistics);
  EXPECT_EQ(watch(Rtps().add(1, 0, pad(8)).add(9, 2, {}).add(1, 0, {})), Refusal::kNone);
  EXPECT_EQ(watch(Rtps().add(1, 0, pad(8), 12)), Refusal::kLength);
  EXPECT_EQ(watch(Rtps().add(0x42, 0, pad(8))), Refusal::kUnknownSubmessage);
  EXPECT_EQ(watch(Rtps().add(0x0F, 0, pad(32))), Refusal::kUnknownSubmessage) << "INFO_REPLY";
  EXPECT_EQ(watch(Rtps().add(0x0C, 0, pad(24))), Refusal::kShort) << "INFO_SRC of another size";
}

TEST(RtpsGuard, RefusesNumbersAndSetsThatBreakTheStandard) {
  Watch watch;
  const auto acknack = [](std::uint64_t base, std::uint32_t bits, std::size_t words) {
    return Rtps().add(6, 0,
                      Rtps::cat({Rtps::u32(0), Rtps::u32(0), Rtps::number(base), Rtps::u32(bits),
                                 pad(4 * words), Rtps::u32(1)}));
  };
  EXPECT_EQ(watch(acknack(5, 32, 1)), Refusal::kNone);
  EXPECT_EQ(watch(acknack(5, 257, 9)), Refusal::kSet);
  EXPECT_EQ(watch(acknack(5, 256, 2)), Refusal::kSet);
  EXPECT_EQ(watch(acknack(1ULL << 63U, 0, 0)), Refusal::kSequenceNumber);
  EXPECT_EQ(watch(Rtps().heartbeat(kWriter, 9, 5, 1)), Refusal::kSequenceNumber);
  EXPECT_EQ(watch(Rtps().heartbeat(kWriter, 1, 0, 1)), Refusal::kNone) << "nothing written yet";
  EXPECT_EQ(watch(Rtps().gap(kWriter, 9, 5)), Refusal::kSequenceNumber);
  EXPECT_EQ(watch(Rtps().gap(kWriter, 0, 5)), Refusal::kSequenceNumber);
  EXPECT_EQ(watch(Rtps().data(kWriter, 0, pad(8))), Refusal::kSequenceNumber);
  EXPECT_EQ(watch(Rtps().data(kWriter, 1, pad(8), 12)), Refusal::kPayload) << "data and key";
}

TEST(RtpsGuard, RefusesParametersThatDoNotFitTheirKindAndStandardOnesItDoesNotKnow) {
  const auto with = [](std::uint16_t id, const Datagram& value) {
    return Rtps().announce(10, "127.0.0.1", Rtps::parameter(id, value));
  };
  Watch watch;
  EXPECT_EQ(watch(with(0x62, Rtps::string("name"))), Refusal::kNone);
  EXPECT_EQ(watch(with(0x62, Rtps::cat({Rtps::u32(400), pad(4)}))), Refusal::kParameter);
  EXPECT_EQ(watch(with(0x62, Rtps::cat({Rtps::u32(4), {'a', 'b', 'c', 'd'}}))), Refusal::kParameter)
      << "a string without its end";
  EXPECT_EQ(watch(with(0x59, Rtps::u32(0xFFFFFFFF))), Refusal::kParameter);
  EXPECT_EQ(watch(with(0x29, Rtps::u32(0xFFFFFFFF))), Refusal::kParameter);
  EXPECT_EQ(watch(with(0x2C, Rtps::u32(0xFFFFFFFF))), Refusal::kParameter);
  EXPECT_EQ(watch(with(0x73, Rtps::u32(0xFFFFFFFF))), Refusal::kParameter)
      << "Fast DDS appends as many as it claims";
  EXPECT_EQ(watch(with(0x8006, Rtps::u32(0xFFFFFFFF))), Refusal::kParameter);
  EXPECT_EQ(watch(with(0x1A, pad(8))), Refusal::kParameter);
  EXPECT_EQ(watch(with(0x00F0, pad(8))), Refusal::kUnknownParameter);
  EXPECT_EQ(watch(with(0x7FFF, pad(8))), Refusal::kUnknownParameter);
  EXPECT_EQ(watch(with(0xC123, pad(8))), Refusal::kUnknownParameter) << "must be understood";
  EXPECT_EQ(watch(with(0x8123, pad(8))), Refusal::kNone) << "another vendor's own";
  EXPECT_EQ(watch(Rtps().data(Rtps::kSpdp, 1, {0, 3, 0, 0, 0x15, 0, 4, 0, 2, 3, 0, 0})),
            Refusal::kParameterList);
  EXPECT_EQ(watch(Rtps().data(Rtps::kSpdp, 1, {0, 1, 0, 0, 1, 0, 0, 0})), Refusal::kPayload);
  EXPECT_EQ(watch(Rtps().data(kWriter, 1, pad(8), 4, Rtps::parameter(0x71, pad(8)))),
            Refusal::kParameter)
      << "inline QoS";
}

TEST(RtpsGuard, RefusesTokensAndHandshakesThatClaimMoreThanTheyHave) {
  Watch watch;
  const Datagram name = Rtps::string("DDS:Auth:PKI-DH:1.0");
  const auto token = [](std::uint16_t id, const Datagram& value) {
    return Rtps().announce(10, "127.0.0.1", Rtps::parameter(id, value));
  };
  for (const std::uint16_t id : std::initializer_list<std::uint16_t>{0x1001, 0x1002, 0x1006}) {
    EXPECT_EQ(watch(token(id, Rtps::cat({name, Rtps::u32(0), Rtps::u32(0)}))), Refusal::kNone);
    for (const std::uint32_t n : {1U, 0x01000000U, 0xFFFFFFFFU}) {
      EXPECT_EQ(watch(token(id, Rtps::cat({name, Rtps::u32(n)}))), Refusal::kToken);
      EXPECT_EQ(watch(token(id, Rtps::cat({name, Rtps::u32(0), Rtps::u32(n)}))), Refusal::kToken);
      EXPECT_EQ(watch(token(id, Rtps::cat({name, Rtps::u32(0), Rtps::u32(1), name, Rtps::u32(n)}))),
                Refusal::kToken);
    }
    EXPECT_EQ(watch(token(id, Rtps::cat({Rtps::u32(0xFFFFFFF0), pad(8)}))), Refusal::kToken);
  }
  const auto handshake = [&](const Rtps::Prefix& from, const Datagram& rest) {
    return Rtps().data(Rtps::kHandshake, 1,
                       Rtps::cat({{0, 1, 0, 0},
                                  Rtps::guid(from, 0x1C1),
                                  Rtps::number(1),
                                  pad(24),
                                  pad(48),
                                  Rtps::string("dds.sec.auth"),
                                  rest}));
  };
  const Datagram holder = Rtps::cat({name, Rtps::u32(0), Rtps::u32(0)});
  EXPECT_EQ(watch(handshake(Rtps::kMe, Rtps::cat({Rtps::u32(1), holder}))), Refusal::kNone);
  for (const std::uint32_t n : {2U, 17U, 0x01000000U, 0xFFFFFFFFU})
    EXPECT_EQ(watch(handshake(Rtps::kMe, Rtps::cat({Rtps::u32(n), holder}))), Refusal::kToken);
  EXPECT_EQ(watch(handshake({9}, Rtps::cat({Rtps::u32(1), holder}))), Refusal::kForeignIdentity);
  EXPECT_EQ(watch(Rtps().data(Rtps::kHandshake, 1, pad(20))), Refusal::kToken);
  EXPECT_EQ(watch(Rtps().data(0xFF0202C3, 1, pad(120))), Refusal::kUnprotected);
  EXPECT_EQ(watch(Rtps().data(0x000300C3, 1, pad(120))), Refusal::kUnknownWriter) << "type lookup";
}

/// As Cyclone DDS sends a certificate and permissions.
TEST(RtpsGuard, HandsOnAHandshakeInPartsOnceItIsWholeAndFits) {
  Watch watch({.encrypted = true});
  const Datagram large = Rtps::cat({Rtps::string("c.id"), Rtps::u32(4000), Datagram(4000, 'c')});
  const auto message = [&](std::uint32_t binary) {
    return Rtps::cat({{0, 1, 0, 0},
                      Rtps::guid(Rtps::kMe, 0x1C1),
                      Rtps::number(1),
                      pad(24),
                      pad(48),
                      Rtps::string("dds.sec.auth"),
                      Rtps::u32(1),
                      Rtps::string("DDS:Auth:PKI-DH:1.0"),
                      Rtps::u32(0),
                      Rtps::u32(binary),
                      large});
  };
  constexpr std::size_t kPart = 1344;
  const auto part = [&](const Datagram& whole, std::uint64_t n, std::uint32_t i) {
    const std::size_t from = (i - 1) * kPart, to = std::min(whole.size(), from + kPart);
    return Rtps()
        .add(0x16, 0,
             Rtps::cat({{0, 0, 28, 0},
                        Rtps::entity(0x000201C4),
                        Rtps::entity(Rtps::kHandshake),
                        Rtps::number(n),
                        Rtps::u32(i),
                        Rtps::u32(std::uint32_t(kPart) << 16U | 1U),
                        Rtps::u32(std::uint32_t(whole.size())),
                        Datagram(whole.begin() + std::ptrdiff_t(from),
                                 whole.begin() + std::ptrdiff_t(to))}))
        .heartbeat_frag(Rtps::kHandshake, n, i, i);
  };
  const Datagram good = message(1);
  const auto parts = std::uint32_t((good.size() + kPart - 1) / kPart);
  ASSERT_EQ(parts, 4U);
  EXPECT_EQ(watch(part(good, 1, 1)), Refusal::kNone);
  EXPECT_TRUE(watch.verdict.assembled.empty()) << "of nobody";
  ASSERT_EQ(watch(Rtps().announce()), Refusal::kNone);
  for (const std::uint32_t i : {3U, 1U, 4U, 1U}) {
    ASSERT_EQ(watch(part(good, 1, i)), Refusal::kNone);
    EXPECT_EQ(watch.patched[20], 1) << "padding: Fast DDS sees none of it yet";
    EXPECT_TRUE(watch.verdict.assembled.empty());
  }
  ASSERT_EQ(watch(part(good, 1, 2)), Refusal::kNone);
  const Datagram whole = Rtps().add(0x15, 4,
                                    Rtps::cat({{0, 0, 16, 0},
                                               Rtps::entity(0x000201C4),
                                               Rtps::entity(Rtps::kHandshake),
                                               Rtps::number(1),
                                               good}));
  const Datagram assembled = watch.verdict.assembled;
  EXPECT_EQ(assembled, whole);
  EXPECT_EQ(watch(assembled), Refusal::kNone);
  // More than there is; of two sizes; larger than anybody's.
  const Datagram bad = message(0x01000000);
  for (std::uint32_t i = 1; i < parts; ++i) ASSERT_EQ(watch(part(bad, 2, i)), Refusal::kNone);
  EXPECT_EQ(watch(part(bad, 2, parts)), Refusal::kToken);
  EXPECT_EQ(watch(part(good, 3, 1)), Refusal::kNone);
  EXPECT_EQ(watch(part(Rtps::cat({good, pad(400)}), 3, 2)), Refusal::kFragmentsDisagree);
  EXPECT_EQ(watch(Rtps().fragment(Rtps::kHandshake, 4, 1, 1344, 70'000, 1344)),
            Refusal::kSampleSize);
  // Who begins many has two.
  for (std::uint64_t n = 5; n < 500; ++n) EXPECT_EQ(watch(part(good, n, 1)), Refusal::kNone);
  for (std::uint32_t i = 2; i <= parts; ++i) EXPECT_EQ(watch(part(good, 400, i)), Refusal::kNone);
  EXPECT_TRUE(watch.verdict.assembled.empty());
}

TEST(RtpsGuard, RefusesEncryptedPartsWhoseCountsDoNotFit) {
  const auto prefix = Rtps::cat({{0, 0, 0, 4}, pad(16)});
  const auto body = Rtps::cat({{0, 0, 0, 8}, pad(8)});
  const auto postfix = Rtps::cat({pad(16), {0, 0, 0, 1}, pad(20)});
  const auto message = [](std::uint8_t first, std::uint8_t last, const Datagram& a,
                          const Datagram& b, const Datagram& c) {
    return Rtps().add(first, 0, a).add(0x30, 0, b).add(last, 0, c);
  };
  Watch watch;
  for (const auto& [first, last] : {std::pair{0x31, 0x32}, std::pair{0x33, 0x34}}) {
    const auto f = std::uint8_t(first), l = std::uint8_t(last);
    EXPECT_EQ(watch(message(f, l, prefix, body, postfix)), Refusal::kNone);
    EXPECT_EQ(watch(message(f, l, pad(24), body, postfix)), Refusal::kSecured);
    // Fast DDS decrypts as many bytes as it is told, wherever the body ends.
    EXPECT_EQ(watch(message(f, l, prefix, Rtps::cat({{0, 0, 0xFF, 0}, pad(8)}), postfix)),
              Refusal::kSecured);
    EXPECT_EQ(
        watch(message(f, l, prefix, body, Rtps::cat({pad(16), {0xFF, 0xFF, 0xFF, 0xFF}, pad(20)}))),
        Refusal::kSecured);
    EXPECT_EQ(watch(Rtps().add(f, 0, prefix).add(l, 0, postfix)), Refusal::kSecured);
    EXPECT_EQ(watch(Rtps().add(f, 0, prefix).add(0x30, 0, body)), Refusal::kSecured);
  }
  EXPECT_EQ(watch(Rtps().add(0x30, 0, body)), Refusal::kUnknownSubmessage) << "on its own";
  EXPECT_EQ(watch(Rtps().add(9, 2, {}).add(0x33, 0, prefix)), Refusal::kUnknownSubmessage)
      << "only at the beginning";
}

TEST(RtpsGuard, WithEverythingEncryptedOnlyAnnouncementsAndTheHandshakeArePlain) {
  Watch watch({.encrypted = true});
  EXPECT_EQ(watch(Rtps().announce()), Refusal::kNone);
  EXPECT_EQ(watch(Rtps().announce_writer(kWriter, "t")), Refusal::kUnprotected);
  EXPECT_EQ(watch(Rtps().data(kWriter, 1, pad(8))), Refusal::kUnprotected);
  EXPECT_EQ(watch(Rtps().heartbeat(kWriter, 1, 1, 1)), Refusal::kUnprotected);
  EXPECT_EQ(watch(Rtps().gap(kWriter, 1, 2)), Refusal::kUnprotected);
  EXPECT_EQ(watch(Rtps().fragment(kWriter, 1, 1, 1024, 4096, 1024)), Refusal::kUnprotected);
}

TEST(RtpsGuard, LetsLongJumpsOfNumbersThroughInStepsThatFastDdsWalksInASecond) {
  Watch watch;
  ASSERT_EQ(watch(Rtps().announce()), Refusal::kNone);
  // Long runs make large numbers: who joins late is told at which to begin.
  constexpr std::uint64_t kYear = 315'360'000;
  std::uint64_t begun = 0;
  for (std::uint32_t n = 1; n < 120 && begun < kYear; ++n) {
    ASSERT_EQ(watch(Rtps().heartbeat(kWriter, kYear, kYear, n)), Refusal::kNone) << n;
    Cursor c(Bytes(watch.patched).subspan(32), true);
    const std::uint64_t next = c.sequence();
    EXPECT_LE(next - begun, NumberBudget::kAtOnce + 2);
    EXPECT_GT(next, begun);
    begun = next;
    watch.now += 1s;
  }
  EXPECT_EQ(begun, kYear);
  // Without time passing, the steps are used up: nobody is hung.
  Watch other;
  ASSERT_EQ(other(Rtps().announce()), Refusal::kNone);
  EXPECT_EQ(other(Rtps().heartbeat(Rtps::kPublications, 1ULL << 60U, 1ULL << 60U, 1)),
            Refusal::kNone);
  EXPECT_EQ(other(Rtps().heartbeat(Rtps::kPublications, 1ULL << 60U, 1ULL << 60U, 2)),
            Refusal::kNumberJump);
  EXPECT_EQ(other(Rtps().gap(kWriter, 1, 1ULL << 40U)), Refusal::kNumberJump);
  // Nor is a stale count a way round it.
  EXPECT_EQ(other(Rtps().heartbeat(Rtps::kPublications, 1ULL << 61U, 1ULL << 61U, 1)),
            Refusal::kNumberJump);
}

TEST(RtpsGuard, ForgetsNumbersWhenFastDdsDoesSoThatNoneIsWalkedUnseen) {
  const auto jump = [](std::uint32_t n) {
    return Rtps().heartbeat(kWriter, 1U << 23U, 1U << 23U, n);
  };
  Watch watch;
  ASSERT_EQ(watch(Rtps().announce(2)), Refusal::kNone);
  for (std::uint32_t n = 1; n <= 10; ++n) ASSERT_EQ(watch(jump(n)), Refusal::kNone) << "no jump";
  // A lease that ran out is an end: walked again, so it counts again.
  watch.now += 10s;
  ASSERT_EQ(watch(jump(1)), Refusal::kNone);
  for (int i = 0; i < 3; ++i) {
    watch.now += 2500ms;
    ASSERT_EQ(watch(jump(std::uint32_t(i) + 2)), Refusal::kNone);
  }
}

/// At the moment when its lease ends as well, Fast DDS ends by an assertion.
TEST(RtpsGuard, FastDdsIsNotToldOfTheEndOfAParticipantButOfItsEndpoints) {
  Watch watch;
  ASSERT_EQ(watch(Rtps().announce()), Refusal::kNone);
  const Datagram end = Rtps().end(Rtps::kSpdp, 2, 0x1C1);
  ASSERT_EQ(watch(end), Refusal::kNone);
  EXPECT_EQ(watch.patched[20], 1) << "padding";
  EXPECT_TRUE(std::equal(end.begin() + 21, end.end(), watch.patched.begin() + 21));
  Datagram to_the_end = end;
  to_the_end[22] = to_the_end[23] = 0;
  EXPECT_EQ(watch(to_the_end), Refusal::kPayload) << "padding of no length is followed by its body";
  EXPECT_EQ(watch(Rtps().end(Rtps::kPublications, 1, kWriter)), Refusal::kNone);
  EXPECT_TRUE(watch.verdict.patches.empty());
  // A key alone says no end, nor does a status that Fast DDS does not know.
  EXPECT_EQ(watch(Rtps().data(Rtps::kSpdp, 1, Rtps::guid(Rtps::kMe, 0x1C1), 8)), Refusal::kPayload);
  EXPECT_EQ(watch(Rtps().end(Rtps::kSpdp, 3, 0x1C1, 4)), Refusal::kPayload);
  for (std::uint32_t n = 1; n < 3; ++n) {
    const Refusal found = watch(Rtps().heartbeat(kWriter, 1ULL << 60U, 1ULL << 60U, n));
    EXPECT_TRUE(found == Refusal::kNumberJump || !watch.verdict.patches.empty()) << n;
    EXPECT_EQ(watch(Rtps().gap(kWriter, 1, 1ULL << 40U)), Refusal::kNumberJump);
  }
}

/// The status says 4: a living participant to Fast DDS.
TEST(RtpsGuard, AnAnnouncementIsNoEndWhateverItsStatusSays) {
  Watch watch;
  const auto announced = [](std::uint8_t who) {
    Rtps::Prefix prefix = Rtps::kMe;
    prefix[4] = who;
    return Rtps(prefix).data(Rtps::kSpdp, 1,
                             Rtps::list({Rtps::parameter(0x50, Rtps::guid(prefix, 0x1C1))}), 4,
                             Rtps::cat({Rtps::parameter(0x71, {0, 0, 0, 4}), {1, 0, 0, 0}}));
  };
  int passed = 0;
  for (int who = 0; who < 250; ++who)
    passed += watch(announced(std::uint8_t(who))) == Refusal::kNone ? 1 : 0;
  EXPECT_EQ(passed, int(Newcomers::kAtOnce)) << "they count as newcomers";
}

TEST(RtpsGuard, BelievesNoKeyHashOfWhatLives) {
  Watch watch;
  const auto sample = [](std::uint8_t status) {
    return Rtps().data(kWriter, 1, pad(8), 4,
                       Rtps::cat({Rtps::parameter(0x70, pad(16)),
                                  Rtps::parameter(0x71, {0, 0, 0, status}),
                                  Rtps::parameter(0x70, pad(16)),
                                  {1, 0, 0, 0}}));
  };
  ASSERT_EQ(watch(sample(0)), Refusal::kNone);
  EXPECT_EQ(watch.patched[44], 0) << "padding";
  EXPECT_EQ(watch.patched[44 + 28], 0);
  EXPECT_EQ(watch.patched[44 + 20], 0x71);
  ASSERT_EQ(watch(sample(1)), Refusal::kNone);
  EXPECT_TRUE(watch.verdict.patches.empty()) << "the end of an instance has nothing else";
}

TEST(RtpsGuard, EndpointsAreSoManyOfOneAndOfAllAndComeBackAFewASecond) {
  Watch watch;
  const auto prefix_of = [](std::uint32_t who) {
    Rtps::Prefix prefix = Rtps::kMe;
    prefix[4] = std::uint8_t(who);
    return prefix;
  };
  const auto announced = [&](std::uint32_t who, std::uint32_t n, std::uint64_t number) {
    const bool writer = n % 2 == 0;
    return watch(Rtps(prefix_of(who))
                     .announce_endpoint(writer ? Rtps::kPublications : Rtps::kSubscriptions, number,
                                        n << 8U | (writer ? 2U : 7U), "t", "T")) == Refusal::kNone;
  };
  std::uint32_t passed = 0;
  for (std::uint32_t who = 0; who < 10; ++who) {
    ASSERT_EQ(watch(Rtps(prefix_of(who)).announce(60)), Refusal::kNone);
    std::uint32_t its = 0;
    for (std::uint32_t n = 1; n <= 1000; ++n) its += announced(who, n, n) ? 1 : 0;
    EXPECT_LE(its, Participant::kEndpoints);
    passed += its;
  }
  EXPECT_EQ(passed, std::uint32_t(Participants::kEndpointsAtOnce));
  EXPECT_TRUE(announced(0, 1, 1)) << "what is sent again is not read again";
  watch.now += 1s;
  // Who ends one and announces it again has a few a second.
  passed = 0;
  for (std::uint32_t n = 0; n < 50; ++n) {
    ASSERT_EQ(watch(Rtps(prefix_of(0)).end(Rtps::kSubscriptions, 2000 + 2 * n, 0x107)),
              Refusal::kNone);
    passed += announced(0, 1, 2001 + 2 * n) ? 1 : 0;
  }
  EXPECT_EQ(passed, std::uint32_t(Participant::kEndpointsPerSecond));
  // So has who only says something else of it: another partition, and back.
  watch.now += 1s;
  passed = 0;
  for (std::uint32_t n = 0; n < 50; ++n) passed += announced(1, 1, 3000 + n) ? 1 : 0;
  EXPECT_EQ(passed, std::uint32_t(2 * Participant::kEndpointsPerSecond));
}

TEST(RtpsGuard, SamplesApartFromEachOtherAreBounded) {
  Watch watch;
  ASSERT_EQ(watch(Rtps().announce(60)), Refusal::kNone);
  int passed = 0;
  for (std::uint64_t n = 2; n < 20'000; n += 2)
    passed += watch(Rtps().data(kWriter, n, pad(8))) == Refusal::kNone ? 1 : 0;
  EXPECT_GT(passed, 1000);
  EXPECT_LT(passed, 4000);
  EXPECT_EQ(watch(Rtps().data(kWriter, 1, pad(8))), Refusal::kNone) << "those between are welcome";
}

TEST(RtpsGuard, AGapCostsWhatIsWalkedAlsoIfItSaysNothingNew) {
  Watch watch;
  ASSERT_EQ(watch(Rtps().announce()), Refusal::kNone);
  int passed = 0;
  for (int i = 0; i < 100; ++i)
    passed += watch(Rtps().gap(kWriter, 1, 1U << 20U)) == Refusal::kNone ? 1 : 0;
  EXPECT_GT(passed, 0);
  EXPECT_LE(passed, int(NumberBudget::kAtOnce / NumberBudget::kGapCosts >> 20U));
}

TEST(RtpsGuard, WhatOneReaderWasToldIsNotKnownToAnotherNorWhatIsForAnotherParticipant) {
  const Rtps::Prefix self = {5, 5, 5}, other = {6, 6, 6};
  const auto jump = [](std::uint32_t reader, std::uint32_t count) {
    return Rtps::cat({Rtps::entity(reader), Rtps::entity(kWriter), Rtps::number(1U << 23U),
                      Rtps::number(1U << 23U), Rtps::u32(count)});
  };
  Watch watch;
  watch.guard.set_self(self);
  ASSERT_EQ(watch(Rtps().announce()), Refusal::kNone);
  for (std::uint32_t n = 1; n < 9; ++n)
    ASSERT_EQ(
        watch(Rtps().add(0x0E, 0, Datagram(other.begin(), other.end())).add(7, 2, jump(0x1004, n))),
        Refusal::kNone)
        << "it costs us nothing";
  int passed = 0;
  for (std::uint32_t reader = 1; reader < 9; ++reader)
    passed += watch(Rtps().add(7, 2, jump(reader << 8U | 4U, 1))) == Refusal::kNone ? 1 : 0;
  EXPECT_LE(passed, 3) << "each is walked";
}

TEST(RtpsGuard, GapsHoldLittleMemoryAndBeginWhereNothingIsKept) {
  Watch watch;
  ASSERT_EQ(watch(Rtps().announce()), Refusal::kNone);
  // Apart from what has come: Fast DDS keeps each number in a set.
  std::uint64_t let_through = 0;
  for (std::uint64_t n = 0; n < 2000; ++n)
    if (watch(Rtps().gap(kWriter, 2 + n * 70'000, 2 + n * 70'000 + 65'000)) == Refusal::kNone) {
      Cursor c(Bytes(watch.patched).subspan(32), true);
      const std::uint64_t start = c.sequence();
      let_through += c.sequence() - start;
    }
  EXPECT_GT(let_through, 10'000U);
  EXPECT_LE(let_through, NumberBudget::kHeld + 65'536) << "64 bytes each";
  // From the first on: a long gap is let through, and told from number 1 on.
  Watch other;
  ASSERT_EQ(other(Rtps().announce()), Refusal::kNone);
  ASSERT_EQ(other(Rtps().data(kWriter, 1, pad(8))), Refusal::kNone);
  ASSERT_EQ(other(Rtps().gap(kWriter, 2, 1'000'000)), Refusal::kNone);
  Cursor c(Bytes(other.patched).subspan(32), true);
  EXPECT_EQ(c.sequence(), 1U);
  EXPECT_EQ(c.sequence(), 1'000'000U);
}

TEST(RtpsGuard, FragmentsOfASampleAgreeAreLargeEnoughAndOfATopicsSize) {
  Watch watch({.largest_sample = [](const std::string& t) { return t == "small" ? 8000U : 0U; }});
  ASSERT_EQ(watch(Rtps().announce()), Refusal::kNone);
  const auto frag = [](std::uint64_t n, std::uint32_t first, std::uint16_t size,
                       std::uint32_t sample, std::size_t bytes) {
    return Rtps().fragment(kWriter, n, first, size, sample, bytes);
  };
  EXPECT_EQ(watch(frag(5, 1, 1024, 100'000, 1024)), Refusal::kNone);
  EXPECT_EQ(watch(frag(5, 0, 1024, 100'000, 1024)), Refusal::kFragment);
  EXPECT_EQ(watch(frag(5, 99, 1024, 100'000, 1024)), Refusal::kFragment) << "beyond the sample";
  EXPECT_EQ(watch(frag(5, 2, 1024, 100'000, 1000)), Refusal::kFragment) << "shorter than it says";
  EXPECT_EQ(watch(frag(5, 2, 8, 100'000, 8)), Refusal::kFragment) << "tiny ones";
  EXPECT_EQ(watch(frag(5, 2, 2048, 100'000, 2048)), Refusal::kFragmentsDisagree);
  EXPECT_EQ(watch(frag(5, 2, 1024, 100'004, 1024)), Refusal::kFragmentsDisagree);
  EXPECT_EQ(watch(frag(6, 1, 2048, 100'000, 2048)), Refusal::kFragmentsDisagree)
      << "another size while a sample is open";
  EXPECT_EQ(watch(frag(6, 1, 1024, 0x7FFFFFFF, 1024)), Refusal::kSampleSize);
  EXPECT_EQ(watch(Rtps().fragment(Rtps::kPublications, 1, 1, 1024, 32U << 20U, 1024)),
            Refusal::kBuiltinFragment);
  // However many come after it, what may still be open is not forgotten for another size.
  for (std::uint64_t n = 7; n < 7000; ++n)
    ASSERT_EQ(watch(frag(n, 1, 1024, 100'000, 1024)), Refusal::kNone);
  EXPECT_NE(watch(frag(5, 2, 1024, 100'004, 1024)), Refusal::kNone);
  ASSERT_EQ(watch(Rtps().announce_writer(0x1303, "small")), Refusal::kNone);
  EXPECT_EQ(watch(Rtps().fragment(0x1303, 1, 1, 1024, 8000, 1024)), Refusal::kNone);
  EXPECT_EQ(watch(Rtps().fragment(0x1303, 2, 1, 1024, 8004, 1024)), Refusal::kSampleSize);
}

TEST(RtpsGuard, NobodyIsSentToAThirdPartyAndLeasesEndWithinAMinute) {
  Watch watch({.domain = 0});
  const auto lease = [&] {
    const auto& d = watch.patched;
    for (std::size_t at = 48; at + 12 <= d.size(); at += 4)
      if (d[at] == 2 && d[at + 1] == 0 && d[at + 2] == 8 && d[at + 3] == 0) return d[at + 4] + 0U;
    return 0U;
  };
  ASSERT_EQ(watch(Rtps().announce(0, "10.99.0.5"), kFar), Refusal::kNone);
  EXPECT_EQ(lease(), 1U) << "a newcomer is not to end while it is made";
  ASSERT_EQ(watch(Rtps().announce(0x7FFFFFFF, "10.99.0.5"), kFar), Refusal::kNone);
  EXPECT_EQ(lease(), 60U);
  Watch fresh({.domain = 0});
  EXPECT_EQ(fresh(Rtps().announce(10, "10.99.0.6"), kFar), Refusal::kForeignLocator);
  EXPECT_EQ(fresh(Rtps().announce(10, "127.0.0.1"), kFar), Refusal::kForeignLocator)
      << "our own loopback";
  // A host with two interfaces: the one that reached us stays.
  const Datagram both = Rtps::parameter(0x32, Rtps::locator("192.168.7.7", 7410));
  ASSERT_EQ(fresh(Rtps().announce(10, "10.99.0.5", both), kFar), Refusal::kNone);
  const auto has = [&](const Datagram& part) {
    return std::search(fresh.patched.begin(), fresh.patched.end(), part.begin(), part.end()) !=
           fresh.patched.end();
  };
  EXPECT_TRUE(has(Rtps::parameter(0x32, Rtps::locator("10.99.0.5", 7410))));
  EXPECT_FALSE(has(both));
  ASSERT_EQ(fresh(Rtps().announce(10, "192.168.7.7"), 0xC0A80707), Refusal::kNone)
      << "it named that address itself";
  for (const Datagram& group :
       {Rtps::locator("239.255.0.1", 7400), Rtps::locator("239.255.0.1", 53),
        Rtps::locator("239.1.2.3", 7400), Rtps::locator("10.99.0.5", 7, 16)}) {
    const Datagram more = Rtps::parameter(0x33, group);
    ASSERT_EQ(fresh(Rtps().announce(10, "10.99.0.5", more), kFar), Refusal::kNone);
    EXPECT_EQ(has(more), group == Rtps::locator("239.255.0.1", 7400));
  }
  // On one host, whichever of its addresses.
  Watch host;
  host.guard.set_own_addresses({kFar, kOther});
  EXPECT_EQ(host(Rtps().announce(10, "10.99.0.6"), kFar), Refusal::kNone);
  EXPECT_EQ(host(Rtps().announce(10, "10.99.0.5"), kLoopback), Refusal::kNone);
}

TEST(RtpsGuard, NobodySpeaksForAnother) {
  const Rtps::Prefix you = {7, 7, 7};
  Watch watch;
  ASSERT_EQ(watch(Rtps().announce(10, "10.99.0.5"), kFar), Refusal::kNone);
  EXPECT_EQ(watch(Rtps().heartbeat(kWriter, 1, 1, 1), kOther), Refusal::kSpoofedSource);
  EXPECT_EQ(watch(Rtps().announce(10, "10.99.0.6"), kOther), Refusal::kSpoofedSource);
  EXPECT_EQ(watch(Rtps().heartbeat(kWriter, 1, 1, 1), kFar), Refusal::kNone);
  // By INFO_SRC.
  EXPECT_EQ(
      watch(Rtps(you).add(
                0x0C, 0,
                Rtps::cat({pad(4), {2, 3, 1, 15}, Datagram(Rtps::kMe.begin(), Rtps::kMe.end())})),
            kOther),
      Refusal::kSpoofedSource);
  // In a payload, or by the key of what ends.
  EXPECT_EQ(
      watch(Rtps(you).data(Rtps::kPublications, 1,
                           Rtps::list({Rtps::parameter(0x5A, Rtps::guid(Rtps::kMe, kWriter))})),
            kOther),
      Refusal::kForeignIdentity);
  EXPECT_EQ(watch(Rtps(you).data(Rtps::kSpdp, 1, {}, 0,
                                 Rtps::cat({Rtps::parameter(0x70, Rtps::guid(Rtps::kMe, 0x1C1)),
                                            Rtps::parameter(0x71, {0, 0, 0, 3}),
                                            {1, 0, 0, 0}})),
                  kOther),
            Refusal::kForeignIdentity);
  EXPECT_EQ(watch(Rtps(you).data(Rtps::kLiveliness, 1,
                                 Rtps::cat({{0, 1, 0, 0}, Rtps::guid(Rtps::kMe, 1), pad(4)})),
                  kOther),
            Refusal::kForeignIdentity);
  // But a discovery server, where there are some.
  const Rtps::Prefix server = {0x44, 0x53, 1, 0x5f, 0x45, 0x50, 0x52, 0x4f, 0x53, 0x49, 0x4d, 0x41};
  const Datagram relayed =
      Rtps(server).data(Rtps::kSpdp, 1,
                        Rtps::list({Rtps::parameter(0x50, Rtps::guid(you, 0x1C1)),
                                    Rtps::parameter(0x32, Rtps::locator("10.99.0.9", 7410))}));
  EXPECT_EQ(watch(relayed, kOther), Refusal::kForeignIdentity);
  Watch served({.servers = true});
  EXPECT_EQ(served(relayed, kOther), Refusal::kNone);
  EXPECT_TRUE(served.verdict.patches.empty());
}

TEST(RtpsGuard, TakesOutTypesAndFiltersWhichNobodyHereUses) {
  Watch watch;
  for (const std::uint16_t id : std::initializer_list<std::uint16_t>{0x35, 0x69, 0x72, 0x75}) {
    const Datagram deep = Rtps::parameter(id, Datagram(400, 0x41));
    ASSERT_EQ(watch(Rtps().data(
                  Rtps::kSubscriptions, 1,
                  Rtps::list({Rtps::parameter(0x5A, Rtps::guid(Rtps::kMe, 0x1204)), deep}))),
              Refusal::kNone);
    EXPECT_EQ(
        std::search(watch.patched.begin(), watch.patched.end(), deep.begin(), deep.begin() + 8),
        watch.patched.end());
  }
}

TEST(RtpsGuard, LetsNewParticipantsThroughOnlySoManyAtOnceAndKnownOnesAlways) {
  const auto announcement = [](std::uint32_t who) {
    Rtps::Prefix prefix{};
    for (unsigned i = 0; i < 4; ++i) prefix[i] = static_cast<std::uint8_t>(who >> (8 * i));
    return Rtps(prefix).announce();
  };
  Watch watch;
  EXPECT_EQ(watch(announcement(0)), Refusal::kNone);
  std::uint32_t passed = 1;
  for (std::uint32_t who = 1; who < 2000; ++who)
    if (watch(announcement(who)) == Refusal::kNone) ++passed;
  EXPECT_EQ(passed, std::uint32_t(Newcomers::kAtOnce));
  EXPECT_EQ(watch(announcement(0)), Refusal::kNone) << "it was there before the flood";
  watch.now += 10s;
  passed = 0;
  for (std::uint32_t who = 3000; who < 4000; ++who)
    if (watch(announcement(who)) == Refusal::kNone) ++passed;
  EXPECT_EQ(passed, std::uint32_t(10 * Newcomers::kPerSecond));
}

TEST(RtpsGuard, WhoWasThereBeforeAFloodComesBackAmidItWithItsEndpoints) {
  const auto flood = [](Watch& watch, std::uint32_t first) {
    for (std::uint32_t who = first; who < first + 1000; ++who) {
      Rtps::Prefix prefix{9};
      for (unsigned i = 0; i < 4; ++i) prefix[i + 1] = static_cast<std::uint8_t>(who >> (8 * i));
      if (watch(Rtps(prefix).announce(1)) != Refusal::kNone) continue;
      for (std::uint32_t n = 1; n <= 20; ++n)
        (void)watch(
            Rtps(prefix).announce_endpoint(Rtps::kSubscriptions, n, n << 8U | 7U, "t", "T"));
    }
  };
  const auto came_back = [&flood](std::chrono::seconds was_there) {
    Watch watch;
    for (auto s = 0s; s <= was_there; s += 1s, watch.now += 1s)
      EXPECT_EQ(watch(Rtps().announce(5)), Refusal::kNone);
    flood(watch, 0);
    watch.now += 10s;  // the host is busy with them, and its lease ends
    flood(watch, 5000);
    return watch(Rtps().announce(5)) == Refusal::kNone &&
           watch(Rtps().announce_endpoint(Rtps::kPublications, 1, kWriter, "t", "T")) ==
               Refusal::kNone;
  };
  EXPECT_TRUE(came_back(60s));
  EXPECT_FALSE(came_back(5s)) << "nobody told it from the flood yet";
}

TEST(RtpsGuard, AFloodAtOneAddressKeepsNobodyOutAtAnother) {
  Watch watch;
  const auto passed = [&watch](std::uint8_t flood, Ipv4 source, const std::string& address) {
    int count = 0;
    for (std::uint32_t who = 0; who < 2000; ++who) {
      Rtps::Prefix prefix{flood, std::uint8_t(who), std::uint8_t(who >> 8U)};
      count += watch(Rtps(prefix).announce(10, address), source) == Refusal::kNone ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(passed(1, kFar, "10.99.0.5"), int(Newcomers::kOfOneAddressAtOnce));
  EXPECT_EQ(passed(2, kOther, "10.99.0.6"), int(Newcomers::kOfOneAddressAtOnce));
  EXPECT_EQ(passed(3, kLoopback, "127.0.0.1"), int(Newcomers::kAtOnce)) << "this host's own";
}

TEST(RtpsGuard, EveryReasonHasAText) {
  for (int i = 0; i < int(Refusal::kCount); ++i)
    EXPECT_NE(text(static_cast<Refusal>(i)), "unknown") << i;
}

}  // namespace
}  // namespace crane::guard
