// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <stdexcept>

#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "base/log.hpp"
#include "base/result.hpp"
#include "base/stage_times.hpp"
#include "base/two_threads.hpp"
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

TEST(OnTwoThreads, BothMeetAsOftenAsTheyLikeAndSeeWhatTheOtherDid) {
  for (int trial = 0; trial < 50; ++trial) {
    int left = 0, right = 0, wrong = 0, wrong_too = 0;
    on_two_threads(
        [&](Meeting& meeting) {
          for (int i = 1; i <= 100; ++i) {
            left = i;
            meeting.meet();
            wrong += right != i ? 1 : 0;
            meeting.meet();
          }
        },
        [&](Meeting& meeting) {
          for (int i = 1; i <= 100; ++i) {
            right = i;
            meeting.meet();
            wrong_too += left != i ? 1 : 0;
            meeting.meet();
          }
        });
    ASSERT_EQ(wrong + wrong_too, 0);
  }
}

TEST(OnTwoThreads, OneAnnouncesWithoutWaitingAndTheOtherAwaitsIt) {
  for (int trial = 0; trial < 200; ++trial) {
    int made = 0, seen = 0;
    const auto makes = [&](Meeting& meeting) {
      made = 1;
      meeting.announce();
    };
    const auto sees = [&](Meeting& meeting) {
      meeting.await();
      seen = made;
    };
    if (trial % 2 == 0)
      on_two_threads(makes, sees);
    else
      on_two_threads(sees, makes);
    ASSERT_EQ(seen, 1);
  }
}

TEST(OnTwoThreads, WhatEitherThrowsArrivesAndNobodyWaitsForOneThatFailed) {
  const auto fails = [](Meeting&) { throw std::runtime_error("no memory"); };
  const auto waits = [](Meeting& meeting) {
    for (int i = 0; i < 3; ++i) meeting.meet();
  };
  for (int trial = 0; trial < 50; ++trial) {
    EXPECT_THROW(on_two_threads(fails, waits), std::runtime_error);
    EXPECT_THROW(on_two_threads(waits, fails), std::runtime_error);
    EXPECT_THROW(on_two_threads(fails, fails), std::runtime_error);
    const auto awaits = [](Meeting& meeting) { meeting.await(); };
    EXPECT_THROW(on_two_threads(fails, awaits), std::runtime_error);
    EXPECT_THROW(on_two_threads(awaits, fails), std::runtime_error);
  }
}

}  // namespace
}  // namespace crane
