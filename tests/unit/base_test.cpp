// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <stdexcept>

#include <atomic>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>
#include <thread>
#include <vector>

#include "base/log.hpp"
#include "base/result.hpp"
#include "base/stage_times.hpp"
#include "base/threads.hpp"
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

/// In a process of its own: what was said before counts against the allowance.
void log_much() {
  set_log_name("cranemap-test");
  set_log_format(LogFormat::kJson);
  log_error("a \"quote\",\na line end, and \xff no UTF-8");
  for (int i = 0; i < 2000; ++i) log_warning("flood " + std::to_string(i));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  log_info("last");
  std::exit(0);
}

TEST(LogDeathTest, WritesJsonLinesAndCutsAFloodShort) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        testing::internal::CaptureStderr();
        std::atexit([] {
          std::istringstream lines(testing::internal::GetCapturedStderr());
          int count = 0;
          bool left_out = false;
          nlohmann::json entry;
          for (std::string line; std::getline(lines, line); ++count) {
            entry = nlohmann::json::parse(line);
            left_out |=
                entry["text"].get<std::string>().find("lines left out") != std::string::npos;
            if (count == 0 && entry["text"].get<std::string>().find("a \"quote\",\na line") != 0)
              _exit(1);
          }
          _exit(count < 320 && left_out && entry["text"] == "last" &&
                        entry["service"] == "cranemap-test" && entry["level"] == "INFO"
                    ? 42
                    : 2);
        });
        log_much();
      },
      testing::ExitedWithCode(42), "");
}

class OnThreads : public testing::TestWithParam<int> {};

TEST_P(OnThreads, AllMeetAsOftenAsTheyLikeAndSeeWhatTheOthersDid) {
  const int threads = GetParam();
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<int> at(std::size_t(threads), 0), wrong = at;
    on_threads(threads, [&](int thread, Meeting& meeting) {
      for (int i = 1; i <= 100; ++i) {
        at[std::size_t(thread)] = i;
        meeting.meet();
        for (const int other : at) wrong[std::size_t(thread)] += other != i ? 1 : 0;
        meeting.meet();
      }
    });
    ASSERT_EQ(std::accumulate(wrong.begin(), wrong.end(), 0), 0);
  }
}

TEST_P(OnThreads, OneAnnouncesWithoutWaitingAndTheOthersAwaitIt) {
  for (int trial = 0; trial < 100; ++trial) {
    const int maker = trial % GetParam();
    int made = 0;
    std::atomic<int> seen = 0;
    on_threads(GetParam(), [&](int thread, Meeting& meeting) {
      if (thread == maker) {
        made = 1;
        meeting.announce();
      } else {
        meeting.await();
        seen += made;
      }
    });
    ASSERT_EQ(seen, GetParam() - 1);
  }
}

TEST_P(OnThreads, WhatAnyThrowsArrivesAndNobodyWaitsForOneThatFailed) {
  for (int fails = 0; fails < GetParam(); ++fails)
    for (const bool awaits : {false, true})
      EXPECT_THROW(on_threads(GetParam(),
                              [&](int thread, Meeting& meeting) {
                                if (thread == fails) throw std::runtime_error("no memory");
                                if (awaits) meeting.await();
                                for (int i = 0; i < 3; ++i) meeting.meet();
                              }),
                   std::runtime_error);
}

INSTANTIATE_TEST_SUITE_P(Base, OnThreads, testing::Values(1, 2, 3, 8));

TEST(Threads, SharesCoverAllAndTheDefaultIsTheMachinesAtMostFour) {
  for (const int count : {0, 1, 5, 360})
    for (int threads = 1; threads <= kMostThreads; ++threads) {
      int next = 0;
      for (int thread = 0; thread < threads; ++thread) {
        const Share share = share_of(count, thread, threads);
        EXPECT_EQ(share.begin, next);
        next = share.end;
      }
      EXPECT_EQ(next, count);
    }
  EXPECT_EQ(threads_or_default(3), 3);
  EXPECT_EQ(threads_or_default(99), kMostThreads);
  EXPECT_LE(threads_or_default(0), 4);
  EXPECT_GE(threads_or_default(0), 1);
}

}  // namespace
}  // namespace crane
