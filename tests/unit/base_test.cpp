#include <gtest/gtest.h>

#include <thread>

#include "base/result.hpp"
#include "base/stage_times.hpp"
#include "base/wakeup.hpp"

namespace crane {
namespace {

TEST(Result, SaysWhereWhatAndWhatToDo) {
  const Result<int> failed = Error{ErrorCode::kResource, "disk", "is full", "free some space"};
  EXPECT_FALSE(failed);
  EXPECT_EQ(failed.error().text(), "disk: is full -> free some space");
}

TEST(Result, ReadingTheValueOfAFailedOneIsABug) {
  const Result<int> failed = Error{};
  EXPECT_DEATH((void)failed.value(), "BUG");
}

TEST(StageTimes, PercentilesAreWithinOnePercent) {
  StageTimes times;
  for (int i = 1; i <= 1000; ++i) times.add("stage", i);
  const auto summary = times.summary();
  ASSERT_EQ(summary.size(), 1U);
  EXPECT_EQ(summary[0].count, 1000U);
  EXPECT_NEAR(summary[0].p50_ms, 500, 6);
  EXPECT_NEAR(summary[0].p99_ms, 990, 11);
  EXPECT_DOUBLE_EQ(summary[0].max_ms, 1000);
}

TEST(StageTimes, TakesZeroNegativeAndHugeDurations) {
  StageTimes times;
  for (double ms : {0.0, -1.0, 1e12}) times.add("odd", ms);
  EXPECT_EQ(times.summary()[0].count, 3U);
  EXPECT_DOUBLE_EQ(times.summary()[0].max_ms, 1e12);
}

TEST(Wakeup, ANotificationBeforeTheWaitIsNotLost) {
  Wakeup wakeup;
  wakeup.notify();
  EXPECT_TRUE(wakeup.wait_for(std::chrono::milliseconds(0)));
  EXPECT_FALSE(wakeup.wait_for(std::chrono::milliseconds(0)));
}

}  // namespace
}  // namespace crane
