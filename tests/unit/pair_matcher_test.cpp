// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/pair_matcher.hpp"

#include <gtest/gtest.h>

#include <mutex>
#include <random>
#include <thread>

#include "fake_v4l2.hpp"
#include "sensors/camera/device_clock.hpp"
#include "sensors/camera/paired_device.hpp"
#include "sensors/camera/v4l2_device.hpp"

namespace crane {
namespace {

using By = PairRule::By;
constexpr TimeNs kMs = 1'000'000;

HalfFrame half(TimeNs time, std::uint64_t number = 0) {
  HalfFrame out;
  out.image = {static_cast<std::uint8_t>(number)};
  out.facts.exposure_time = time;
  out.facts.number = number;
  return out;
}

TEST(PairMatcher, ImagesOfOneTimeMeetWhoeverComesFirstAndTheNewestPairWins) {
  DropCounts dropped;
  PairMatcher matcher({By::kTime, 5 * kMs});
  matcher.add(0, half(100 * kMs), dropped);
  EXPECT_FALSE(matcher.take());
  matcher.add(1, half(103 * kMs), dropped);
  const auto pair = matcher.take();
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->left.facts.exposure_time, 100 * kMs);
  EXPECT_EQ(pair->right.facts.exposure_time, 103 * kMs);
  EXPECT_FALSE(matcher.take()) << "once";
  for (const int n : {2, 3, 4}) {
    matcher.add(1, half(n * 100 * kMs + kMs), dropped);
    matcher.add(0, half(n * 100 * kMs), dropped);
  }
  EXPECT_EQ(matcher.take()->left.facts.exposure_time, 400 * kMs);
  EXPECT_EQ(dropped.of(Cause::kFrameOvertaken), 2U);
  EXPECT_EQ(dropped.of(Cause::kPairIncomplete), 0U);
}

TEST(PairMatcher, AnImageWhoseOtherIsLostIsCountedAndTheNextPairIsRight) {
  DropCounts dropped;
  PairMatcher matcher({By::kTime, 5 * kMs});
  matcher.add(0, half(100 * kMs), dropped);
  matcher.add(0, half(200 * kMs), dropped);
  matcher.add(1, half(201 * kMs), dropped);
  EXPECT_EQ(matcher.take()->left.facts.exposure_time, 200 * kMs);
  EXPECT_EQ(dropped.of(Cause::kPairIncomplete), 1U);
}

TEST(PairMatcher, ACameraWithoutItsOtherFillsNoMemory) {
  DropCounts dropped;
  PairMatcher matcher({By::kTime, 5 * kMs});
  for (int n = 1; n <= 1000; ++n) matcher.add(1, half(n * 100 * kMs), dropped);
  EXPECT_EQ(matcher.waiting(1), PairMatcher::kMostWaiting);
  EXPECT_EQ(dropped.of(Cause::kPairIncomplete), 1000 - PairMatcher::kMostWaiting);
}

TEST(PairMatcher, AClockThatIsSetBackLetsNothingOldMeetTheNew) {
  DropCounts dropped;
  PairMatcher matcher({By::kTime, 5 * kMs});
  matcher.add(0, half(900'000 * kMs), dropped);
  matcher.add(0, half(100 * kMs), dropped);
  matcher.add(1, half(100 * kMs), dropped);
  EXPECT_EQ(matcher.take()->left.facts.exposure_time, 100 * kMs);
  EXPECT_EQ(dropped.of(Cause::kPairIncomplete), 1U);
}

TEST(PairMatcher, NumbersThatBeganApartStayApartAndDecideWhereTimesAreLoose) {
  DropCounts dropped;
  PairMatcher matcher({By::kNumber, 80 * kMs});  // of a period of 100 ms
  // The left one was started three triggers earlier.
  matcher.add(0, half(100 * kMs, 3), dropped);
  matcher.add(1, half(100 * kMs, 0), dropped);
  ASSERT_TRUE(matcher.take());
  // 60 ms late: nearer to the next left image than to its own.
  matcher.add(0, half(200 * kMs, 4), dropped);
  matcher.add(0, half(300 * kMs, 5), dropped);
  matcher.add(1, half(260 * kMs, 1), dropped);
  const auto pair = matcher.take();
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->left.facts.number, 4U);
  EXPECT_EQ(pair->right.facts.number, 1U);
  EXPECT_EQ(dropped.of(Cause::kPairIncomplete), 0U);
}

TEST(PairMatcher, ACameraThatMissedATriggerIsFoundOutAndNeverPairedWrongly) {
  DropCounts dropped;
  PairMatcher matcher({By::kNumber, 80 * kMs});
  std::uint64_t right = 0;
  int pairs = 0;
  for (std::uint64_t n = 0; n < 20; ++n) {
    const auto time = static_cast<TimeNs>(n + 1) * 100 * kMs;
    matcher.add(0, half(time, n), dropped);
    if (n != 5) matcher.add(1, half(time, right++), dropped);  // it counts its triggers, less one
    if (const auto pair = matcher.take()) {
      ++pairs;
      EXPECT_EQ(pair->left.facts.exposure_time, pair->right.facts.exposure_time);
    }
  }
  EXPECT_EQ(matcher.relearned(), 1U);
  EXPECT_GE(pairs, 20 - 1 - 2 * PairMatcher::kRelearn);
  EXPECT_GT(dropped.of(Cause::kPairIncomplete), 0U);
}

TEST(PairMatcher, WhateverComesIsPairedOrWaitsOrIsCounted) {
  std::mt19937 random(11);
  for (const By by : {By::kTime, By::kNumber}) {
    DropCounts dropped;
    PairMatcher matcher({by, 5 * kMs});
    std::uint64_t given = 0;
    std::uint64_t paired = 0;
    for (int n = 0; n < 5000; ++n) {
      const int side = static_cast<int>(random() % 2);
      const TimeNs time = static_cast<TimeNs>(n / 2) * 20 * kMs + random() % 12 * kMs -
                          (random() % 500 == 0 ? 100'000 * kMs : 0);
      matcher.add(side, half(time, n / 2 + random() % 2), dropped);
      ++given;
      if (const auto pair = matcher.take()) {
        paired += 2;
        EXPECT_LE(std::abs(pair->left.facts.exposure_time - pair->right.facts.exposure_time),
                  5 * kMs);
      }
    }
    EXPECT_EQ(given, paired + matcher.waiting(0) + matcher.waiting(1) +
                         dropped.of(Cause::kPairIncomplete) +
                         2 * dropped.of(Cause::kFrameOvertaken));
    EXPECT_GT(paired, 100U);
  }
}

TEST(DeviceClock, TheLeastLateFrameTellsTheOffsetAndDriftIsFollowed) {
  DeviceClock clock;
  const TimeNs began = 1'000 * kNsPerSecond;  // when the device's clock was 0
  std::mt19937 random(5);
  TimeNs worst = 0;
  for (TimeNs t = 0; t < 60 * kNsPerSecond; t += 66 * kMs) {
    const TimeNs device = t + t / 20'000;  // 50 ppm fast
    const TimeNs late = kMs / 5 + (random() % 4 == 0 ? random() % (40 * kMs) : 0);
    const TimeNs error = clock.to_host(device, began + t + late) - (began + t);
    if (t > kNsPerSecond) worst = std::max(worst, std::abs(error));
  }
  EXPECT_LT(worst, kMs / 2);
  EXPECT_EQ(clock.steps(), 0U);
}

TEST(DeviceClock, AClockThatWasSetBeginsAnew) {
  DeviceClock clock;
  for (TimeNs t = 1; t < 10; ++t) (void)clock.to_host(t * kMs, t * kMs + 5 * kNsPerSecond);
  // Set back, as after a restart; and then ahead.
  EXPECT_EQ(clock.to_host(0, 20 * kNsPerSecond), 20 * kNsPerSecond);
  EXPECT_EQ(clock.to_host(900 * kNsPerSecond, 21 * kNsPerSecond), 21 * kNsPerSecond);
  EXPECT_EQ(clock.steps(), 2U);
}

/// Two V4L2 nodes of one image each.
class TwoNodes : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kWidth = 32, kHeight = 16;
  /// A fake that its thread and the test share.
  struct Shared {
    test::FakeCamera camera;
    std::mutex mutex;
  };
  class Locked final : public V4l2Io {
    Shared& shared_;
    test::FakeV4l2 fake_;
    template <class Fn>
    auto with(Fn fn) {
      const std::lock_guard lock(shared_.mutex);
      return fn();
    }

   public:
    explicit Locked(Shared& shared) : shared_(shared), fake_(shared.camera) {}
    int open(const std::string& path) override {
      return with([&] { return fake_.open(path); });
    }
    void close(int fd) override {
      with([&] { return fake_.close(fd), 0; });
    }
    int ioctl(int fd, unsigned long request, void* argument) override {
      return with([&] { return fake_.ioctl(fd, request, argument); });
    }
    void* map(int fd, std::size_t length, std::size_t offset) override {
      return with([&] { return fake_.map(fd, length, offset); });
    }
    void unmap(void* memory, std::size_t length) override {
      with([&] { return fake_.unmap(memory, length), 0; });
    }
    int wait(int fd, int timeout_ms) override {
      const int ready = with([&] { return fake_.wait(fd, timeout_ms); });
      if (ready == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return ready;
    }
  };

  TwoNodes() {
    std::unique_ptr<StereoDevice> nodes[2];
    for (int side : {0, 1}) {
      test::FakeCamera& c = shared_[side].camera;
      c.format = V4L2_PIX_FMT_GREY;
      c.width = kWidth;
      c.height = kHeight;
      V4l2Options o;
      o.path = side == 0 ? "/dev/left" : "/dev/right";
      o.layout = PairLayout::kSideBySideGrey;
      o.single = true;
      o.width = kWidth;
      o.height = kHeight;
      nodes[side] = std::make_unique<V4l2Device>(o, std::make_unique<Locked>(shared_[side]), [] {
        return ClockPair{0, 1'700'000'000 * kNsPerSecond};
      });
    }
    device_ = std::make_unique<PairedDevice>(std::move(nodes[0]), std::move(nodes[1]),
                                             PairRule{By::kTime, 5 * kMs}, kWidth * kHeight,
                                             kWidth * kHeight);
  }
  void give(int side, std::int64_t stamp_us, std::uint8_t seed, std::size_t missing = 0) {
    std::vector<std::uint8_t> bytes(kWidth * kHeight - missing);
    for (std::size_t i = 0; i < bytes.size(); ++i)
      bytes[i] = static_cast<std::uint8_t>(seed + i * 7 + i / kWidth);
    const std::lock_guard lock(shared_[side].mutex);
    shared_[side].camera.frames.push_back(
        {bytes, stamp_us, next_[side]++, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC});
  }
  /// Until a pair or an error comes.
  Result<bool> grab() {
    for (int tries = 0; tries < 200; ++tries) {
      auto got =
          device_->grab({left_.data(), right_.data(), left_.size(), left_.size()}, facts_,
                        std::chrono::steady_clock::now() + std::chrono::milliseconds(50), dropped_);
      if (!got || *got) return got;
    }
    return false;
  }

  Shared shared_[2];
  std::uint32_t next_[2] = {0, 0};
  std::unique_ptr<PairedDevice> device_;
  std::vector<std::uint8_t> left_ = std::vector<std::uint8_t>(kWidth * kHeight), right_ = left_;
  FrameFacts facts_;
  DropCounts dropped_;
};

TEST_F(TwoNodes, GiveOnePairOfOneMomentAndTheirOwnImages) {
  ASSERT_TRUE(device_->open());
  give(0, 1'000'000, 10);
  give(1, 1'002'000, 90);
  const auto got = grab();
  ASSERT_TRUE(got && *got) << device_->remark();
  EXPECT_EQ(left_[0], 10);
  EXPECT_EQ(right_[0], 90);
  EXPECT_EQ(facts_.width, kWidth);
  EXPECT_EQ(facts_.format, PixelFormat::kMono8);
  EXPECT_EQ(facts_.exposure_time, 1'700'000'001 * kNsPerSecond + kMs);
}

TEST_F(TwoNodes, AShortImageCostsItsPairAndBothCausesAreCounted) {
  ASSERT_TRUE(device_->open());
  give(0, 1'000'000, 10);
  give(1, 1'000'000, 90, 5);
  ASSERT_FALSE(*device_->grab({left_.data(), right_.data(), left_.size(), left_.size()}, facts_,
                              std::chrono::steady_clock::now() + std::chrono::milliseconds(50),
                              dropped_));
  give(0, 1'066'000, 11);
  give(1, 1'066'000, 91);
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_EQ(left_[0], 11);
  EXPECT_EQ(right_[0], 91);
  EXPECT_EQ(dropped_.of(Cause::kFrameShort), 1U);
  EXPECT_EQ(dropped_.of(Cause::kPairIncomplete), 1U);
}

TEST_F(TwoNodes, OneUnpluggedIsAnErrorThatNamesItAndBothBeginAnew) {
  ASSERT_TRUE(device_->open());
  {
    const std::lock_guard lock(shared_[1].mutex);
    shared_[1].camera.dequeue_error = ENODEV;
  }
  const auto got = grab();
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().where, "/dev/right");
  device_->close();
  {
    const std::lock_guard lock(shared_[1].mutex);
    shared_[1].camera.dequeue_error = 0;
  }
  // Their threads let them go; until then it is what it was.
  Result<void> opened = device_->open();
  for (int tries = 0; !opened && tries < 10'000; ++tries) {
    EXPECT_EQ(opened.error().where, "/dev/right");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    opened = device_->open();
  }
  ASSERT_TRUE(opened) << opened.error().text();
  EXPECT_EQ(shared_[0].camera.opens, 2);
  EXPECT_EQ(shared_[0].camera.closes, 1);
  give(0, 2'000'000, 3);
  give(1, 2'000'000, 4);
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_EQ(right_[0], 4);
}

TEST_F(TwoNodes, WhichOfThemIsSilentIsSaid) {
  ASSERT_TRUE(device_->open());
  for (int n = 0; n < 20; ++n) {
    give(0, 1'000'000 + n * 66'000, 1);
    for (int tries = 0; tries < 200; ++tries) {  // until it was taken
      ASSERT_FALSE(*device_->grab({left_.data(), right_.data(), left_.size(), left_.size()}, facts_,
                                  {}, dropped_));
      const std::lock_guard lock(shared_[0].mutex);
      if (shared_[0].camera.frames.empty()) break;
      std::this_thread::yield();
    }
  }
  for (int tries = 0; tries < 200 && device_->remark().empty(); ++tries)
    ASSERT_FALSE(*device_->grab({left_.data(), right_.data(), left_.size(), left_.size()}, facts_,
                                std::chrono::steady_clock::now() + std::chrono::milliseconds(5),
                                dropped_));
  EXPECT_NE(device_->remark().find("only the left camera gives images"), std::string::npos)
      << device_->remark();
}

}  // namespace
}  // namespace crane
