// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/live_source.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <optional>

namespace crane {
namespace {

/// What a device does next.
struct Act {
  std::optional<Error> error;
  bool gives = false;
  TimeNs time = 0;
  std::uint64_t missed = 0;
};

class ScriptedDevice final : public StereoDevice {
 public:
  std::deque<Result<void>> opens;  ///< none left: opens
  std::deque<Act> acts;            ///< none left: nothing comes
  int opened = 0, closed = 0;
  std::uint64_t missed_frames = 0;
  bool wakes = true;

  Result<void> open() override {
    if (opens.empty()) return ++opened, Result<void>{};
    const Result<void> answer = opens.front();
    opens.pop_front();
    if (answer) ++opened;
    return answer;
  }
  void close() override { ++closed; }
  Result<bool> grab(const FrameBuffers&, FrameFacts& facts, FrameSource::Deadline,
                    DropCounts&) override {
    if (acts.empty()) return false;
    const Act act = acts.front();
    acts.pop_front();
    if (act.error) return *act.error;
    facts.exposure_time = act.time;
    missed_frames = act.missed;
    return act.gives;
  }
  std::uint64_t missed() const override { return missed_frames; }
  bool reconnects_when_silent() const override { return wakes; }
};

const Error kUnplugged{ErrorCode::kNotAvailable, "/dev/video0", "unplugged", "plug it in"};

class LiveSourceTest : public ::testing::Test {
 protected:
  LiveSourceTest() {
    auto owned = std::make_unique<ScriptedDevice>();
    device_ = owned.get();
    source_ = std::make_unique<LiveSource>(
        std::move(owned), clock_,
        [this](TimeNs t) {
          slept_ += t - clock_.now();
          clock_.advance(std::chrono::nanoseconds(t - clock_.now()));
        },
        [this] { return ++streams_; });
  }
  FrameSource::Next next() {
    const auto got = source_->next({}, facts_, {});
    EXPECT_TRUE(got);
    return got ? *got : FrameSource::Next::kEnd;
  }
  void give(TimeNs time, std::uint64_t missed = 0) {
    device_->acts.push_back({{}, true, time, missed});
  }
  void unplug() { device_->acts.push_back({kUnplugged}); }

  FakeClock clock_{100 * kNsPerSecond};
  TimeNs slept_ = 0;
  std::uint64_t streams_ = 40;
  ScriptedDevice* device_ = nullptr;
  std::unique_ptr<LiveSource> source_;
  FrameFacts facts_;
};

constexpr auto kFrame = FrameSource::Next::kFrame;
constexpr auto kNothing = FrameSource::Next::kNothing;

TEST_F(LiveSourceTest, NumbersFramesFromZeroInAStreamOfItsOwnAtEachConnection) {
  give(kNsPerSecond);
  give(2 * kNsPerSecond);
  unplug();
  give(3 * kNsPerSecond);
  EXPECT_EQ(next(), kNothing);  // connects
  ASSERT_EQ(next(), kFrame);
  EXPECT_EQ(facts_.stream, 41U);
  EXPECT_EQ(facts_.sequence, 0);
  EXPECT_EQ(facts_.after, -1);
  ASSERT_EQ(next(), kFrame);
  EXPECT_EQ(facts_.sequence, 1);
  EXPECT_EQ(next(), kNothing);  // unplugged
  EXPECT_NE(source_->trouble().find("plug it in"), std::string::npos);
  EXPECT_EQ(device_->closed, 1);
  int tries = 0;
  while (next() != kFrame) ASSERT_LT(++tries, 20);
  EXPECT_EQ(facts_.stream, 42U);
  EXPECT_EQ(facts_.sequence, 0);
  EXPECT_EQ(source_->trouble(), "");
  EXPECT_EQ(source_->dropped().of(Cause::kCameraLost), 1U);
  EXPECT_EQ(slept_, kNsPerSecond / 4);
}

TEST_F(LiveSourceTest, WaitsLongerAfterEachFailureUpToEightSecondsAndNapsInBetween) {
  for (int n = 0; n < 8; ++n) device_->opens.emplace_back(kUnplugged);
  while (device_->opened == 0) {
    const TimeNs before = clock_.now();
    ASSERT_EQ(next(), kNothing);
    EXPECT_LE(clock_.now() - before, kNsPerSecond / 20);  // the service's loop goes on turning
  }
  // 0.25 + 0.5 + 1 + 2 + 4 + 8 + 8 + 8
  EXPECT_EQ(slept_, 31'750'000'000);
  EXPECT_EQ(source_->dropped().of(Cause::kCameraLost), 0U);  // it was never there
}

TEST_F(LiveSourceTest, AWrongConfigurationIsAnErrorAndNotTriedAgain) {
  device_->opens.emplace_back(Error{ErrorCode::kConfiguration, "camera", "no such mode", ""});
  const auto got = source_->next({}, facts_, {});
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().code, ErrorCode::kConfiguration);
}

TEST_F(LiveSourceTest, FramesThatTheDeviceMissedAreGapsInTheNumbersAndCounted) {
  give(kNsPerSecond, 7);  // what was before the first is not ours
  give(2 * kNsPerSecond, 3);
  next();
  ASSERT_EQ(next(), kFrame);
  EXPECT_EQ(facts_.sequence, 0);
  ASSERT_EQ(next(), kFrame);
  EXPECT_EQ(facts_.sequence, 4);
  EXPECT_EQ(source_->dropped().of(Cause::kCameraMissedFrame), 3U);
}

TEST_F(LiveSourceTest, TimesThatGoBackALittleAreRefusedAndALotAreAClockThatWasSet) {
  give(50 * kNsPerSecond);
  give(50 * kNsPerSecond);
  give(50 * kNsPerSecond - 1);
  give(10 * kNsPerSecond);
  next();
  ASSERT_EQ(next(), kFrame);
  EXPECT_EQ(next(), kNothing);
  EXPECT_EQ(next(), kNothing);
  ASSERT_EQ(next(), kFrame);
  EXPECT_EQ(facts_.stream, 42U);
  EXPECT_EQ(facts_.sequence, 0);
  EXPECT_EQ(source_->dropped().of(Cause::kExposureNotLater), 2U);
  EXPECT_EQ(source_->dropped().of(Cause::kCameraClockSet), 1U);
}

TEST_F(LiveSourceTest, ACameraThatIsConnectedAndSilentIsSaidAndConnectedAnew) {
  next();
  clock_.advance(std::chrono::nanoseconds(LiveSource::kSilent - 1));
  next();
  EXPECT_EQ(source_->trouble(), "");
  clock_.advance(std::chrono::nanoseconds(1));
  next();
  EXPECT_NE(source_->trouble().find("no usable pair for 5 s"), std::string::npos);
  EXPECT_EQ(device_->closed, 1);
}

TEST_F(LiveSourceTest, ASilentFolderIsSaidAndStaysOpenUntilAPairComes) {
  device_->wakes = false;
  next();
  clock_.advance(std::chrono::nanoseconds(LiveSource::kSilent));
  next();
  EXPECT_NE(source_->trouble().find("no usable pair for 5 s"), std::string::npos);
  EXPECT_EQ(device_->closed, 0);
  give(kNsPerSecond);
  ASSERT_EQ(next(), kFrame);
  EXPECT_EQ(facts_.stream, 41U);
  EXPECT_EQ(source_->trouble(), "");
}

}  // namespace
}  // namespace crane
