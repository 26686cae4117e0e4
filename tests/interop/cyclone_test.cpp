// SPDX-License-Identifier: Apache-2.0
// The same IDL on another vendor's DDS: every topic in both directions, compared field by field,
// and a living map followed by a program in C that has none of our code.

#include <gtest/gtest.h>
#include <signal.h>

#include <list>
#include <memory>
#include <thread>

#include "cyclone.hpp"
#include "dds/endpoints.hpp"
#include "integration/domain.hpp"
#include "samples.h"
#include "set_fields.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;

// ------------------------------------------------- the fields of samples.h, for generated C++

/// Generated types, but for those of ours that stand for them.
namespace ours {
using namespace v1;
using dds::PartialCloud;
using dds::StereoFrame;
}  // namespace ours

template <class A, class B>
bool same(const A& is, const B& should) {
  return is == static_cast<A>(should);
}
#define CHECK_F(f, v) EXPECT_TRUE(same(s.f(), v)) << #f;
#define CHECK_S(f, v) EXPECT_STREQ(std::string(s.f().c_str()).c_str(), v) << #f;
#define CHECK_B(f, n)                              \
  EXPECT_EQ(s.f().size(), std::size_t(n)) << #f;   \
  EXPECT_TRUE([&] {                                \
    for (std::size_t i = 0; i < s.f().size(); ++i) \
      if (s.f()[i] != BYTE_AT(i)) return false;    \
    return true;                                   \
  }()) << #f;
#define CHECK_A(f, n, v)                    \
  EXPECT_TRUE([&] {                         \
    for (std::size_t i = 0; i < (n); ++i)   \
      if (!same(s.f()[i], v)) return false; \
    return true;                            \
  }()) << #f;
#define CHECK_O(f, T, FIELDS) check(s.f(), 0);
#define CHECK_Q(f, T, n, FIELDS)                 \
  ASSERT_EQ(s.f().size(), std::size_t(n)) << #f; \
  for (std::size_t q = 0; q < (n); ++q) check(s.f()[q], q);

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#define NESTED(T, FIELDS)                                        \
  void set(ours::T& s, [[maybe_unused]] std::size_t k) {         \
    FIELDS(SET_F, SET_S, SET_B, SET_A, SET_O, SET_Q)             \
  }                                                              \
  void check(const ours::T& s, [[maybe_unused]] std::size_t k) { \
    FIELDS(CHECK_F, CHECK_S, CHECK_B, CHECK_A, CHECK_O, CHECK_Q) \
  }
NESTED(ZoneCorner, ZONE_CORNER)
NESTED(Zone, ZONE)
NESTED(ClearancePose, CLEARANCE_POSE)
NESTED(DropCount, DROP_COUNT)
NESTED(StageTime, STAGE_TIME)
NESTED(StatusFigure, STATUS_FIGURE)
#define TOPIC_FUNCTIONS(T, topic, FIELDS, tl, depth, deadline, liveliness, exclusive) \
  NESTED(T, FIELDS)
ALL_TOPICS(TOPIC_FUNCTIONS)
#pragma GCC diagnostic pop

template <class Topic>
class Cyclone : public ::testing::Test {};

template <class T>
struct Row;
// NOLINTBEGIN(bugprone-macro-parentheses): T is a type, and tl a number
#define ROW(T, topic, FIELDS, tl, depth, deadline, liveliness, exclusive) \
  template <>                                                             \
  struct Row<ours::T> {                                                   \
    static constexpr const char* kName = #topic;                          \
    static constexpr int kTransientLocal = tl, kDepth = depth;            \
    static constexpr int kExclusive = exclusive;                          \
    static constexpr int kDeadline = deadline, kLiveliness = liveliness;  \
  };
ALL_TOPICS(ROW)
// NOLINTEND(bugprone-macro-parentheses)

template <class... T>
::testing::Types<T...> types_of(std::tuple<T...>);
using Topics = decltype(types_of(dds::AllTopics()));
TYPED_TEST_SUITE(Cyclone, Topics);

TYPED_TEST(Cyclone, ReadsEveryFieldThatWeWrite) {
  using Type = typename TypeParam::Type;
  const TempFolder folder;
  auto participant = *dds::Participant::create(settings(), "interop");
  auto writer = *dds::Writer<TypeParam>::create(participant);
  auto sample = std::make_unique<Type>();
  set(*sample, 0);
  // What is transient-local must reach who joins later.
  if (TypeParam::kQos.transient_local) ASSERT_TRUE(writer.write(*sample));
  Process reader =
      cyclone("cyclone_peer", {"check", Row<Type>::kName, std::to_string(settings().domain)},
              folder / "peer.txt");
  if (!TypeParam::kQos.transient_local) {
    ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
    for (int i = 0; i < 100 && reader.running(); ++i) {
      ASSERT_TRUE(writer.write(*sample));
      std::this_thread::sleep_for(50ms);
    }
  }
  EXPECT_EQ(reader.wait(20), 0) << reader.output();
}

TYPED_TEST(Cyclone, WritesEveryFieldThatWeRead) {
  using Type = typename TypeParam::Type;
  const TempFolder folder;
  auto participant = *dds::Participant::create(settings(), "interop");
  auto reader = *dds::Reader<TypeParam>::create(participant, nullptr);
  Process writer =
      cyclone("cyclone_peer", {"send", Row<Type>::kName, std::to_string(settings().domain)},
              folder / "peer.txt");
  bool came = false;
  eventually([&] {
    while (const auto sample = reader.take()) {
      if (!came) check(**sample, 0);
      came = true;
    }
    return came;
  });
  EXPECT_TRUE(came) << writer.output() << " refused: " << reader.counts().invalid;
}

TYPED_TEST(Cyclone, IsGivenTheQosOfTheTable) {
  using R = Row<typename TypeParam::Type>;
  EXPECT_EQ(TypeParam::kQos.transient_local, R::kTransientLocal == 1);
  EXPECT_EQ(TypeParam::kQos.exclusive, R::kExclusive == 1);
  EXPECT_EQ(TypeParam::kQos.depth, R::kDepth);
  EXPECT_EQ(TypeParam::kQos.deadline_ms, R::kDeadline);
  EXPECT_EQ(TypeParam::kQos.liveliness_ms, R::kLiveliness);
}

TEST(CyclonePeer, IsToldWhenATileHasNothingKnownAnyMore) {
  const TempFolder folder;
  auto participant = *dds::Participant::create(settings(), "interop");
  auto writer = *dds::Writer<dds::MapTileTopic>::create(participant);
  v1::MapTile tile;
  set(tile, 0);
  ASSERT_TRUE(writer.write(tile));
  Process reader = cyclone("cyclone_peer", {"ended", "map_tile", std::to_string(settings().domain)},
                           folder / "peer.txt");
  EXPECT_TRUE(
      eventually([&] { return reader.output().find("map_tile: alive") != std::string::npos; }));
  ASSERT_TRUE(writer.dispose(tile));
  EXPECT_EQ(reader.wait(20), 0) << reader.output();
}

TEST(CyclonePeer, FollowsALivingMapSetsAZoneAndAsksForClearance) {
  const TempFolder folder;
  const std::string domain = next_domain();
  std::list<Process> services = live_services(folder, domain);
  services.emplace_back(
      std::vector<std::string>{"cranemap-clearance", "--config", folder / "site.yaml"},
      folder / "clearance.txt");
  std::this_thread::sleep_for(5s);  // in the middle of it
  Process follower = cyclone("cyclone_peer", {"follow", domain}, folder / "peer.txt");
  EXPECT_EQ(follower.wait(40), 0) << follower.output() << services.back().output();
  const std::string said = follower.output();
  EXPECT_NE(said.find("digests equal"), std::string::npos) << said;
  EXPECT_NE(said.find("zone set"), std::string::npos) << said;
  // Far outside of what was ever seen.
  EXPECT_NE(said.find("clearance: verdict 2, reason 4"), std::string::npos) << said;
  for (Process& service : services) service.signal(SIGTERM);
  for (Process& service : services) EXPECT_EQ(service.wait(10), 0) << service.output();
}

}  // namespace
}  // namespace crane::test
