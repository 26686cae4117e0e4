// SPDX-License-Identifier: Apache-2.0
// Every double of every topic, one after the other, as no number at all: refused before it is used.
// The fields are those of the interoperation test, which a contract keeps complete.

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>

#include "dds/validate.hpp"
#include "interop/samples.h"
#include "interop/set_fields.hpp"

namespace crane::dds {
namespace {

/// Generated types, but for those of ours that stand for them.
namespace ours {
using namespace v1;
using dds::PartialCloud;
using dds::StereoFrame;
}  // namespace ours

template <class S>
using Change = std::function<void(S&, double)>;

/// Adds what makes a double of S another one; of fields that are none, nothing.
#define FIELD(f) std::decay_t<decltype(std::declval<const S&>().f())>
#define DOUBLE_F(f, v)                            \
  if constexpr (std::is_same_v<FIELD(f), double>) \
    out.push_back([](S& s, double to) { s.f(static_cast<FIELD(f)>(to)); });
#define DOUBLE_S(f, v)
#define DOUBLE_B(f, n)
#define ELEMENT(f) std::decay_t<decltype(std::declval<S&>().f()[0])>
#define DOUBLE_A(f, n, v)                           \
  if constexpr (std::is_same_v<ELEMENT(f), double>) \
    out.push_back([](S& s, double to) { s.f()[(n)-1] = static_cast<ELEMENT(f)>(to); });
#define DOUBLE_O(f, T, FIELDS)                \
  for (const auto& change : doubles<v1::T>()) \
    out.push_back([change](S& s, double to) { change(s.f(), to); });
#define DOUBLE_Q(f, T, n, FIELDS)             \
  for (const auto& change : doubles<v1::T>()) \
    out.push_back([change](S& s, double to) { change(s.f()[(n)-1], to); });

template <class S>
std::vector<Change<S>> doubles();

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#define NESTED(T, FIELDS)                                              \
  void set(ours::T& s, [[maybe_unused]] std::size_t k) {               \
    FIELDS(SET_F, SET_S, SET_B, SET_A, SET_O, SET_Q)                   \
  }                                                                    \
  template <>                                                          \
  std::vector<Change<ours::T>> doubles<ours::T>() {                    \
    using S = ours::T;                                                 \
    std::vector<Change<S>> out;                                        \
    FIELDS(DOUBLE_F, DOUBLE_S, DOUBLE_B, DOUBLE_A, DOUBLE_O, DOUBLE_Q) \
    return out;                                                        \
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

template <class S>
void refuses_no_numbers(std::size_t& seen) {
  auto sample = std::make_unique<S>();
  set(*sample, 0);
  ASSERT_EQ(flaw(*sample), nullptr);
  const auto changes = doubles<S>();
  for (std::size_t i = 0; i < changes.size(); ++i)
    for (const double to :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
          -std::numeric_limits<double>::infinity()}) {
      auto changed = std::make_unique<S>();
      set(*changed, 0);
      changes[i](*changed, to);
      EXPECT_NE(flaw(*changed), nullptr) << "double " << i << " is " << to;
      ++seen;
    }
}

TEST(Validate, RefusesEveryDoubleOfEveryTopicThatIsNoNumber) {
  std::size_t seen = 0;
#define EACH(T, topic, FIELDS, tl, depth, deadline, liveliness, exclusive) \
  {                                                                        \
    SCOPED_TRACE(#topic);                                                  \
    refuses_no_numbers<ours::T>(seen);                                     \
  }
  ALL_TOPICS(EACH)
  EXPECT_GT(seen, 150U);
}

}  // namespace
}  // namespace crane::dds
