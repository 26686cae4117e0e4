// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/genicam_device.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fake_genicam.hpp"

namespace crane {
namespace {

constexpr std::uint32_t kWidth = 32, kHeight = 16;
constexpr std::uint32_t kMono8 = 0x01080001, kRgb8 = 0x02180014;
constexpr TimeNs kMs = 1'000'000, kStart = 1'700'000'000 * kNsPerSecond;

class GenicamDeviceTest : public ::testing::Test {
 protected:
  GenicamDeviceTest() {
    options_.camera = "cam";
    options_.width = kWidth;
    options_.height = kHeight;
    make();
  }
  void make() {
    device_ = std::make_unique<GenicamDevice>(
        options_, std::make_unique<test::FakeGenicam>(camera_), [this] { return clocks_; });
  }
  /// A picture exposed at `ms` after kStart, with a camera's clock that began `ahead` before.
  void give(std::uint64_t number, int ms, TimeNs late = 0) {
    test::FakeGenicamCamera::Shot shot;
    shot.facts.width = options_.single ? kWidth : 2 * kWidth;
    shot.facts.height = kHeight;
    shot.facts.pixel_format = kMono8;
    shot.facts.number = number;
    shot.facts.stamp = camera_began_ + ms * kMs;
    shot.facts.arrival = kStart + ms * kMs + late;
    shot.chunk = shot.facts.stamp + kNsPerSecond;
    shot.bytes.resize(std::size_t{shot.facts.width} * kHeight);
    for (std::size_t i = 0; i < shot.bytes.size(); ++i)
      shot.bytes[i] = static_cast<std::uint8_t>(number + i * 7);
    camera_.shots.push_back(std::move(shot));
  }
  Result<bool> grab(std::chrono::milliseconds wait = {}) {
    return device_->grab(
        {left_.data(), options_.single ? nullptr : right_.data(), left_.size(), kWidth * kHeight},
        facts_, std::chrono::steady_clock::now() + wait, dropped_);
  }
  void expect_open_error(const std::string& what, const std::string& todo) {
    const auto opened = device_->open();
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::kConfiguration);
    EXPECT_NE(opened.error().what.find(what), std::string::npos) << opened.error().text();
    EXPECT_NE(opened.error().todo.find(todo), std::string::npos) << opened.error().text();
  }
  void expect_refused(Cause cause, const std::string& remark) {
    const auto got = grab();
    ASSERT_TRUE(got);
    EXPECT_FALSE(*got);
    EXPECT_EQ(dropped_.of(cause), 1U);
    EXPECT_NE(device_->remark().find(remark), std::string::npos) << device_->remark();
  }

  test::FakeGenicamCamera camera_;
  GenicamOptions options_;
  ClockPair clocks_{5 * kNsPerSecond, kStart + 5 * kNsPerSecond};
  TimeNs camera_began_ = 1000 * kNsPerSecond;
  std::unique_ptr<GenicamDevice> device_;
  std::vector<std::uint8_t> left_ = std::vector<std::uint8_t>(kWidth * kHeight * 3), right_ = left_;
  FrameFacts facts_;
  DropCounts dropped_;
};

TEST_F(GenicamDeviceTest, SetsWhatItIsToldAndReadsItAgain) {
  options_.exposure_us = 4000;
  options_.gain = 6;
  make();
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(camera_.numbers["Width"].value, 2 * kWidth);
  EXPECT_EQ(camera_.numbers["OffsetX"].value, 0);
  EXPECT_EQ(camera_.numbers["ExposureTime"].value, 4000);
  EXPECT_EQ(camera_.numbers["Gain"].value, 6);
  EXPECT_EQ(camera_.numbers["AcquisitionFrameRate"].value, 15);
  EXPECT_EQ(camera_.texts["ExposureAuto"], "Off");
  EXPECT_EQ(camera_.texts["TriggerMode"], "Off");
  EXPECT_TRUE(camera_.started);
}

TEST_F(GenicamDeviceTest, WhatTheCameraDoesNotTakeIsTheConfigurationsFault) {
  camera_.numbers["Width"].step = 48;
  expect_open_error("Width was set to 64 and is 48", "camera.width");
  camera_.numbers["Width"] = {640, 16, 50, 0};
  expect_open_error("Width 64 is not within its 16 .. 50", "camera.width");
  camera_.numbers["Width"] = {640, 16, 4096, 0};
  options_.pixel_format = "Mono16";
  make();
  expect_open_error("nothing is known of PixelFormat Mono16", "Mono8");
  options_.pixel_format = "BGR8";
  make();
  expect_open_error("BGR8 not found", "camera.pixel_format");
  options_.pixel_format = "Mono8";
  options_.exposure_us = 4000;
  make();
  camera_.numbers.erase("ExposureTime");
  expect_open_error("has no ExposureTime", "leave camera.exposure_100us out");
  options_.exposure_us.reset();
  options_.ptp = true;
  make();
  expect_open_error("does not know PTP", "leave camera.ptp out");
  options_.ptp = false;
  options_.stamps = GenicamOptions::Stamps::kChunk;
  make();
  expect_open_error("has no ChunkModeActive", "camera.stamps: camera");
}

TEST_F(GenicamDeviceTest, ItsOwnClockIsTurnedToTheEpochWhateverTheNetworkDelays) {
  ASSERT_TRUE(device_->open());
  give(1, 100, 0);
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_EQ(facts_.exposure_time, kStart + 100 * kMs);
  EXPECT_EQ(left_[0], 1);
  EXPECT_EQ(right_[0], static_cast<std::uint8_t>(1 + kWidth * 7));
  give(2, 166, 30 * kMs);
  ASSERT_TRUE(*grab());
  EXPECT_EQ(facts_.exposure_time, kStart + 166 * kMs);
  EXPECT_DOUBLE_EQ(facts_.late_ms, 30);
  EXPECT_NE(device_->about().find("own clock"), std::string::npos) << device_->about();
}

TEST_F(GenicamDeviceTest, ChunksTellTheTimeWhereTheyAreAskedFor) {
  camera_.flags = {{"ChunkModeActive", false}, {"ChunkEnable", false}};
  camera_.texts["ChunkSelector"] = "Gain";
  camera_.numbers["GevTimestampTickFrequency"] = {1e9, 1e9, 1e9, 0};
  options_.stamps = GenicamOptions::Stamps::kChunk;
  make();
  ASSERT_TRUE(device_->open());
  EXPECT_TRUE(camera_.flags["ChunkModeActive"]);
  EXPECT_TRUE(camera_.flags["ChunkEnable"]);
  EXPECT_EQ(camera_.texts["ChunkSelector"], "Timestamp");
  give(1, 100);
  ASSERT_TRUE(*grab());
  give(2, 200);
  camera_.shots.back().facts.stamp = 0;  // the leader says nothing
  ASSERT_TRUE(*grab());
  EXPECT_EQ(facts_.exposure_time, kStart + 200 * kMs);
  give(3, 300);
  camera_.shots.back().chunk.reset();
  expect_refused(Cause::kExposureNotLater, "do not say when");
}

TEST_F(GenicamDeviceTest, ByPtpInStepStampsAreTakenAsTheyAreInUtcAndInTai) {
  camera_.flags["PtpEnable"] = false;
  camera_.texts["PtpStatus"] = "Slave";
  options_.ptp = true;
  make();
  for (const TimeNs ahead : {TimeNs{0}, 37 * kNsPerSecond}) {
    camera_began_ = kStart + ahead;
    ASSERT_TRUE(device_->open());
    EXPECT_TRUE(camera_.flags["PtpEnable"]);
    give(1, 100, 20 * kMs);
    ASSERT_TRUE(*grab());
    EXPECT_EQ(facts_.exposure_time, kStart + 100 * kMs);
    EXPECT_EQ(device_->about(), "cam: stamped by PTP");
  }
  camera_.texts["PtpStatus"] = "Listening";
  ASSERT_TRUE(device_->open());
  give(1, 100);
  ASSERT_TRUE(*grab()) << "its clock is followed meanwhile";
  EXPECT_NE(device_->remark().find("PTP is not in step (Listening)"), std::string::npos);
}

TEST_F(GenicamDeviceTest, ACameraWithoutAClockIsSaidToBeStampedByArrival) {
  ASSERT_TRUE(device_->open());
  give(1, 100, 7 * kMs);
  camera_.shots.back().facts.stamp = camera_.shots.back().facts.arrival;
  ASSERT_TRUE(*grab());
  EXPECT_EQ(facts_.exposure_time, kStart + 107 * kMs);
  EXPECT_NE(device_->about().find("when pictures arrive"), std::string::npos);
}

TEST_F(GenicamDeviceTest, PicturesThatMissPacketsAndThoseOfAnotherModeAreCountedAndRefused) {
  ASSERT_TRUE(device_->open());
  give(1, 100);
  camera_.shots.back().facts.state = GenicamPicture::State::kPacketsLost;
  expect_refused(Cause::kPacketsLost, "packets of pictures get lost");
  give(2, 200);
  camera_.shots.back().facts.width = kWidth;
  expect_refused(Cause::kFrameShort, "another size or format");
  give(3, 300);
  camera_.shots.back().facts.pixel_format = kRgb8;  // says more than it has
  const auto got = grab();
  ASSERT_TRUE(got);
  EXPECT_FALSE(*got);
  EXPECT_EQ(dropped_.of(Cause::kFrameShort), 2U);
  give(4, 400);
  EXPECT_TRUE(*grab());
  EXPECT_EQ(device_->remark(), "");
  EXPECT_EQ(device_->missed(), 0U);
}

TEST_F(GenicamDeviceTest, OnlyWhatWasNeverGivenIsMissedAlsoWhereNumbersEnd) {
  ASSERT_TRUE(device_->open());
  give(65'530, 100);
  ASSERT_TRUE(*grab());
  for (const std::uint64_t n : {65'531, 65'533, 65'535}) give(n, 100 + int(n - 65'530) * 66);
  ASSERT_TRUE(*grab());
  EXPECT_EQ(device_->missed(), 2U);
  EXPECT_EQ(dropped_.of(Cause::kFrameOvertaken), 2U);
  give(1, 1000);  // 0 is left out
  ASSERT_TRUE(*grab());
  EXPECT_EQ(device_->missed(), 0U);
  give(3, 1100);
  ASSERT_TRUE(*grab());
  EXPECT_EQ(device_->missed(), 1U);
  EXPECT_EQ(facts_.number, 9U) << "goes on counting";
}

TEST_F(GenicamDeviceTest, SoftwareTriggersAreGivenAtMultiplesOfThePeriod) {
  options_.trigger = "software";
  options_.rate_hz = 200;
  make();
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(camera_.texts["TriggerMode"], "On");
  EXPECT_EQ(camera_.texts["TriggerSource"], "Software");
  EXPECT_EQ(camera_.texts["TriggerSelector"], "FrameStart");
  for (int tries = 0; tries < 100'000 && camera_.triggers < 3; ++tries)
    ASSERT_TRUE(grab(std::chrono::milliseconds(1)));
  EXPECT_GE(camera_.triggers, 3);
  options_.trigger = "Line3";
  make();
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(camera_.texts["TriggerSource"], "Line3");
}

TEST_F(GenicamDeviceTest, OneOfTwoCamerasFillsTheLeftImageOnly) {
  options_.single = true;
  make();
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(camera_.numbers["Width"].value, kWidth);
  EXPECT_EQ(device_->image_bytes(), kWidth * kHeight);
  give(9, 100);
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_EQ(facts_.width, kWidth);
  EXPECT_EQ(left_[1], 16);
  EXPECT_EQ(right_[1], 0);
}

TEST_F(GenicamDeviceTest, ALostCameraIsAnErrorToBeTriedAgain) {
  ASSERT_TRUE(device_->open());
  camera_.gone = true;
  const auto got = grab();
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().code, ErrorCode::kNotAvailable);
  device_->close();
  EXPECT_FALSE(device_->open());
  device_->close();
  camera_.gone = false;
  ASSERT_TRUE(device_->open());
  give(1, 100);
  EXPECT_TRUE(*grab());
}

TEST(Unpack, HandsEveryFormatOnAsItIsAndRefusesWhatIsTooShort) {
  std::vector<std::uint8_t> left(64), right(64);
  FrameFacts facts;
  const FrameBuffers out{left.data(), right.data(), 64, 16};
  const RawFormat rgb{PixelFormat::kRgb8}, mono{PixelFormat::kMono8}, yuyv{PixelFormat::kYuyv},
      uyvy{PixelFormat::kYuyv, true}, mono10{PixelFormat::kMono10p};
  // 4 x 2 RGB pixels with 2 bytes behind each row.
  std::vector<std::uint8_t> bytes(28);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i);
  ASSERT_TRUE(unpack({bytes.data(), bytes.size(), 14, 4, 2, rgb}, false, "x", out, facts));
  EXPECT_EQ(facts.format, PixelFormat::kRgb8);
  EXPECT_EQ(facts.width, 2U);
  EXPECT_EQ((std::vector<std::uint8_t>(left.begin(), left.begin() + 7)),
            (std::vector<std::uint8_t>{0, 1, 2, 3, 4, 5, 14}));
  EXPECT_EQ(right[0], 6);
  // Swapped halves, swapped bytes, pixels that share bytes.
  const std::vector<std::uint8_t> yuv = {1, 99, 2, 98, 3, 97, 4, 96};
  ASSERT_TRUE(unpack({yuv.data(), 8, 0, 4, 1, yuyv}, true, "x", out, facts));
  EXPECT_EQ(left[0], 3);
  EXPECT_EQ(right[2], 2);
  ASSERT_TRUE(unpack({yuv.data(), 8, 0, 4, 1, uyvy}, false, "x", out, facts));
  EXPECT_EQ(left[0], 99);
  EXPECT_EQ(left[1], 1);
  ASSERT_TRUE(unpack({bytes.data(), 10, 0, 8, 1, mono10}, false, "x", out, facts));
  EXPECT_EQ(facts.width, 4U);
  EXPECT_EQ(right[0], 5);
  for (const RawPicture& bad :
       {RawPicture{yuv.data(), 7, 0, 4, 1, yuyv}, RawPicture{yuv.data(), 8, 7, 4, 1, yuyv},
        RawPicture{yuv.data(), 8, 0, 3, 1, mono}, RawPicture{yuv.data(), 8, 0, 4, 1, mono10},
        RawPicture{yuv.data(), 8, 0, 0, 1, mono}, RawPicture{nullptr, 8, 0, 4, 1, mono},
        RawPicture{bytes.data(), 28, 0, 2, 4'000'000'000U, mono},
        RawPicture{bytes.data(), 28, 0, 4'000'000'000U, 1, mono}})
    EXPECT_FALSE(unpack(bad, false, "x", out, facts));
}

}  // namespace
}  // namespace crane
