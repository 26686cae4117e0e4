// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/folder_device.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "recording/image_file.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

Image grey(std::uint8_t value, std::uint32_t width = 8, std::uint32_t channels = 1) {
  return {width, 6, channels, std::vector<std::uint8_t>(std::size_t{width} * 6 * channels, value)};
}

class FolderDeviceTest : public ::testing::Test {
 protected:
  FolderDeviceTest() {
    for (const char* side : {"left", "right"}) fs::create_directory(folder_ / side);
    options_.path = folder_.path();
    make();
  }
  void make() { device_ = std::make_unique<FolderDevice>(options_, now_, steady_); }
  void put(const std::string& side, const std::string& name, const Image& image) {
    // As a writer should: under another name first.
    const fs::path aside = folder_ / "aside.png";
    ASSERT_TRUE(write_image(aside, image));
    fs::rename(aside, folder_.path() / side / name);
  }
  void put_pair(const std::string& name, std::uint8_t value) {
    put("left", name, grey(value));
    put("right", name, grey(static_cast<std::uint8_t>(value + 1)));
  }
  bool grab() {
    const auto got =
        device_->grab({left_.data(), right_.data(), left_.size(), 1000}, facts_, {}, dropped_);
    EXPECT_TRUE(got) << (got ? "" : got.error().text());
    return got && *got;
  }
  void pass(std::chrono::milliseconds time) { steady_.advance(time); }

  test::TempFolder folder_;
  FolderOptions options_;
  FakeClock now_{1'700'000'000 * kNsPerSecond}, steady_{kNsPerSecond};
  std::unique_ptr<FolderDevice> device_;
  std::vector<std::uint8_t> left_ = std::vector<std::uint8_t>(3000), right_ = left_;
  FrameFacts facts_;
  DropCounts dropped_;
};

TEST(TimeOfName, IsNanosecondsInSixteenToNineteenDigitsAndNothingElse) {
  EXPECT_EQ(time_of_name("1700000000000000000"), 1'700'000'000'000'000'000);
  EXPECT_EQ(time_of_name("1000000000000000"), 1'000'000'000'000'000);
  for (const char* other :
       {"", "17", "9999999999999999999", "17000000000000000000", "-170000000000000000",
        "170000000000000000a", "0000000000000000", "frame_00000000001"})
    EXPECT_FALSE(time_of_name(other)) << other;
}

TEST_F(FolderDeviceTest, APairIsTakenOnceWithTheTimeItIsNamedAfter) {
  put_pair("1700000000000000001.png", 10);  // there before: old
  ASSERT_TRUE(device_->open());
  EXPECT_FALSE(grab());
  put("left", "1700000000100000000.png", grey(50));
  EXPECT_FALSE(grab());
  put("right", "1700000000100000000.png", grey(51));
  ASSERT_TRUE(grab());
  EXPECT_EQ(facts_.exposure_time, 1'700'000'000'100'000'000);
  EXPECT_EQ(facts_.width, 8U);
  EXPECT_EQ(facts_.height, 6U);
  EXPECT_EQ(facts_.format, PixelFormat::kMono8);
  EXPECT_EQ(left_[0], 50);
  EXPECT_EQ(right_[47], 51);
  EXPECT_FALSE(grab());
  EXPECT_EQ(device_->remark(), "");
}

TEST_F(FolderDeviceTest, APairLargerThanTheBuffersWaitsForLargerOnes) {
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(device_->image_bytes(), 0U) << "not known";
  put_pair("1700000000100000000.png", 10);
  const auto small = device_->grab({left_.data(), right_.data(), 47, 1000}, facts_, {}, dropped_);
  ASSERT_TRUE(small);
  EXPECT_FALSE(*small);
  EXPECT_EQ(device_->image_bytes(), 48U);
  ASSERT_TRUE(grab());
  EXPECT_EQ(right_[47], 11);
  EXPECT_EQ(dropped_.of(Cause::kImageUnreadable), 0U);
}

TEST_F(FolderDeviceTest, LatencyIsTakenOff) {
  options_.latency = 5'000'000;
  make();
  ASSERT_TRUE(device_->open());
  put_pair("1700000000100000000.png", 1);
  ASSERT_TRUE(grab());
  EXPECT_EQ(facts_.exposure_time, 1'700'000'000'095'000'000);
}

TEST_F(FolderDeviceTest, TheNewestPairWinsAndOlderOnesAreCounted) {
  ASSERT_TRUE(device_->open());
  for (const int n : {1, 2, 3})
    put_pair("170000000" + std::to_string(n) + "000000000.png", static_cast<std::uint8_t>(n * 10));
  ASSERT_TRUE(grab());
  EXPECT_EQ(left_[0], 30);
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kFrameOvertaken), 2U);
}

TEST_F(FolderDeviceTest, AFileStillBeingWrittenIsTakenWhenItIsWhole) {
  ASSERT_TRUE(device_->open());
  put("right", "1700000000100000000.png", grey(51));
  const std::string whole = folder_ / "whole.png";
  ASSERT_TRUE(write_image(whole, grey(50)));
  std::ifstream in(whole, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  std::ofstream out(folder_ / "left/1700000000100000000.png", std::ios::binary);
  for (std::size_t at = 0; at < bytes.size(); at += 20) {
    EXPECT_FALSE(grab()) << at;
    out << bytes.substr(at, 20) << std::flush;
    pass(std::chrono::milliseconds(900));  // slow, but it grows
  }
  ASSERT_TRUE(grab());
  EXPECT_EQ(left_[0], 50);
  EXPECT_EQ(dropped_.of(Cause::kImageUnreadable), 0U);
  EXPECT_EQ(dropped_.of(Cause::kPairIncomplete), 0U);
}

TEST_F(FolderDeviceTest, WhatIsNoImageAndDoesNotGrowIsCountedOnceAndNamed) {
  ASSERT_TRUE(device_->open());
  put("right", "1700000000100000000.png", grey(51));
  std::ofstream(folder_ / "left/1700000000100000000.png") << "no image";
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kImageUnreadable), 0U);
  pass(std::chrono::seconds(1));
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kImageUnreadable), 1U);
  EXPECT_NE(device_->remark().find("left/1700000000100000000.png"), std::string::npos);
  pass(std::chrono::seconds(5));
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kImageUnreadable), 1U);
  put_pair("1700000000200000000.png", 7);
  ASSERT_TRUE(grab());
  EXPECT_EQ(device_->remark(), "");
}

TEST_F(FolderDeviceTest, ASingleImageWaitsASecondForItsOther) {
  ASSERT_TRUE(device_->open());
  put("left", "1700000000100000000.png", grey(50));
  EXPECT_FALSE(grab());
  pass(std::chrono::milliseconds(999));
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kPairIncomplete), 0U);
  pass(std::chrono::milliseconds(1));
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kPairIncomplete), 1U);
  EXPECT_FALSE(device_->remark().empty());
}

TEST_F(FolderDeviceTest, PairsThatDifferInColourOrSizeAreRefused) {
  ASSERT_TRUE(device_->open());
  put("left", "1700000000100000000.png", grey(50));
  put("right", "1700000000100000000.png", grey(50, 8, 3));
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kColourDiffers), 1U);
  put("left", "1700000000200000000.png", grey(50));
  put("right", "1700000000200000000.png", grey(50, 9));
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kImageUnreadable), 1U);
}

TEST_F(FolderDeviceTest, ImagesOfAnotherSizeThanTheCalibrationAreRefusedAndNamed) {
  StereoRig rig;
  rig.left.width = rig.right.width = 16;
  rig.left.height = rig.right.height = 6;
  options_.rig = rig;
  make();
  ASSERT_TRUE(device_->open());
  put_pair("1700000000100000000.png", 1);
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kImageUnreadable), 1U);
  EXPECT_NE(device_->remark().find("8 x 6 pixels, the calibration is of 16 x 6"),
            std::string::npos);
  put("left", "1700000000200000000.png", grey(5, 16));
  put("right", "1700000000200000000.png", grey(6, 16));
  EXPECT_TRUE(grab()) << "one wrong file ends nothing";
}

TEST_F(FolderDeviceTest, NamesWithoutATimeAreStampedByTheirFileAndThatIsSaid) {
  ASSERT_TRUE(device_->open());
  put_pair("frame_1.png", 9);
  const fs::path left = folder_ / "left/frame_1.png";
  ASSERT_TRUE(grab());
  const auto written = fs::last_write_time(left);
  const auto wall = std::chrono::file_clock::to_sys(written).time_since_epoch();
  EXPECT_EQ(facts_.exposure_time,
            std::chrono::duration_cast<std::chrono::nanoseconds>(wall).count());
  EXPECT_NE(device_->remark().find("camera.latency_ms"), std::string::npos);
}

TEST_F(FolderDeviceTest, NamesOfAnotherClockAreSaid) {
  ASSERT_TRUE(device_->open());
  put_pair("1600000000000000000.png", 9);
  ASSERT_TRUE(grab());
  EXPECT_NE(device_->remark().find("need one clock"), std::string::npos);
}

TEST_F(FolderDeviceTest, HiddenAndOtherFilesAreNotLookedAt) {
  ASSERT_TRUE(device_->open());
  for (const char* side : {"left", "right"})
    for (const char* name : {".1700000000100000000.png", "1700000000100000000.tmp", "notes"})
      std::ofstream(folder_.path() / side / name) << "x";
  pass(std::chrono::seconds(2));
  EXPECT_FALSE(grab());
  pass(std::chrono::seconds(2));
  EXPECT_FALSE(grab());
  std::size_t causes = 0;
  dropped_.for_each([&](Cause, std::uint64_t) { ++causes; });
  EXPECT_EQ(causes, 0U);
}

TEST_F(FolderDeviceTest, RemovesWhatItReadAndPassedOverWhenToldTo) {
  options_.remove = true;
  make();
  put_pair("1700000000000000000.png", 1);  // old: not its business
  ASSERT_TRUE(device_->open());
  put_pair("1700000000100000000.png", 1);
  put_pair("1700000000200000000.png", 2);
  ASSERT_TRUE(grab());
  EXPECT_FALSE(fs::exists(folder_ / "left/1700000000100000000.png"));
  EXPECT_FALSE(fs::exists(folder_ / "right/1700000000200000000.png"));
  EXPECT_TRUE(fs::exists(folder_ / "left/1700000000000000000.png"));
}

TEST_F(FolderDeviceTest, AFloodOfSinglesIsBoundedAndCounted) {
  ASSERT_TRUE(device_->open());
  for (std::size_t n = 0; n < FolderDevice::kMostWaiting + 3; ++n)
    std::ofstream(folder_ / ("left/a" + std::to_string(n) + ".png")) << "x";
  EXPECT_FALSE(grab());
  EXPECT_EQ(dropped_.of(Cause::kFrameOvertaken), 3U);
}

TEST_F(FolderDeviceTest, AFolderThatIsNotThereIsNamedAndMayComeLater) {
  fs::remove_all(folder_ / "right");
  const auto opened = device_->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kNotAvailable);
  EXPECT_NE(opened.error().text().find("camera.path"), std::string::npos);
  fs::create_directory(folder_ / "right");
  EXPECT_TRUE(device_->open());
  fs::remove_all(folder_ / "left");  // unmounted
  EXPECT_FALSE(device_->grab({}, facts_, {}, dropped_));
}

}  // namespace
}  // namespace crane
