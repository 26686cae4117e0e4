// SPDX-License-Identifier: Apache-2.0
#include "base/drop_counts.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace crane {
namespace {

TEST(DropCounts, EveryCauseHasATextOfItsOwnThatFitsThePublishedField) {
  std::set<std::string_view> texts;
  for (std::uint32_t number = 0; number < 200; ++number) {
    const auto cause = cause_of(number);
    if (!cause) continue;
    EXPECT_EQ(static_cast<std::uint32_t>(*cause), number);
    EXPECT_TRUE(texts.insert(cause_text(*cause)).second) << cause_text(*cause);
    EXPECT_FALSE(cause_text(*cause).empty());
    EXPECT_LE(cause_text(*cause).size(), 63U) << cause_text(*cause);
    DropCounts counts;  // and a place to be counted at
    counts.add(*cause, 3);
    EXPECT_EQ(counts.of(*cause), 3U);
  }
  EXPECT_GT(texts.size(), 50U);
}

TEST(DropCounts, MergingTakesOverWhatTheOtherCounts) {
  DropCounts a, b;
  a.add(Cause::kCloudMissing, 2);
  b.add(Cause::kSentAgain);
  b.add(Cause::kSentAgain);
  a.merge(b);
  b.add(Cause::kSentAgain);
  a.merge(b);  // what is merged again is not counted twice
  std::size_t causes = 0;
  a.for_each([&](Cause, std::uint64_t) { ++causes; });
  EXPECT_EQ(causes, 2U);
  EXPECT_EQ(a.of(Cause::kCloudMissing), 2U);
  EXPECT_EQ(a.of(Cause::kSentAgain), 3U);
}

}  // namespace
}  // namespace crane
