// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/v4l2_device.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "fake_v4l2.hpp"
#include "recording/image_file.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

using test::FakeCamera;

constexpr std::uint32_t kWidth = 32, kHeight = 16;

/// Luma that never repeats; different for each side.
std::uint8_t luma(bool left, std::size_t x, std::size_t y) {
  return static_cast<std::uint8_t>((x * 7 + y * 31 + (left ? 0 : 97)) % 200 + 20);
}

/// A frame of both images, side by side, YUYV.
std::vector<std::uint8_t> yuyv(std::uint32_t padding = 0) {
  std::vector<std::uint8_t> out;
  for (std::size_t y = 0; y < kHeight; ++y) {
    for (std::size_t x = 0; x < 2 * kWidth; ++x) {
      out.push_back(luma(x < kWidth, x % kWidth, y));
      out.push_back(128);
    }
    out.insert(out.end(), padding, 0xEE);
  }
  return out;
}

class V4l2DeviceTest : public ::testing::Test {
 protected:
  V4l2DeviceTest() {
    options_.width = kWidth;
    options_.height = kHeight;
    make();
  }
  void make() {
    device_ = std::make_unique<V4l2Device>(options_, std::make_unique<test::FakeV4l2>(camera_),
                                           [this] { return clocks_; });
  }
  void give(std::uint32_t sequence, std::vector<std::uint8_t> bytes = yuyv(),
            std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
    camera_.frames.push_back({std::move(bytes), 1'000'000 + sequence * 66'000, sequence, flags});
  }
  Result<bool> grab() {
    return device_->grab({left_.data(), right_.data(), left_.size(), left_.size()}, facts_, {},
                         dropped_);
  }
  void expect_open_error(ErrorCode code, const std::string& what, const std::string& todo) {
    const auto opened = device_->open();
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, code) << opened.error().text();
    EXPECT_EQ(opened.error().where, options_.path);
    EXPECT_NE(opened.error().what.find(what), std::string::npos) << opened.error().text();
    EXPECT_NE(opened.error().todo.find(todo), std::string::npos) << opened.error().text();
  }
  void expect_refused(Cause cause, const std::string& remark) {
    const auto got = grab();
    ASSERT_TRUE(got);
    EXPECT_FALSE(*got);
    EXPECT_EQ(dropped_.of(cause), 1U);
    EXPECT_NE(device_->remark().find(remark), std::string::npos) << device_->remark();
    EXPECT_EQ(camera_.queued.size(), 4U) << "the buffer goes back";
  }

  FakeCamera camera_;
  V4l2Options options_;
  ClockPair clocks_{5 * kNsPerSecond, 1'700'000'005 * kNsPerSecond};
  std::unique_ptr<V4l2Device> device_;
  std::vector<std::uint8_t> left_ = std::vector<std::uint8_t>(kWidth * kHeight * 3), right_ = left_;
  FrameFacts facts_;
  DropCounts dropped_;
};

TEST_F(V4l2DeviceTest, LumaOfBothHalvesIsTheGreyPairStampedOnTheEpoch) {
  ASSERT_TRUE(device_->open());
  EXPECT_TRUE(camera_.streaming);
  give(0);
  const auto got = grab();
  ASSERT_TRUE(got && *got) << device_->remark();
  EXPECT_EQ(facts_.width, kWidth);
  EXPECT_EQ(facts_.height, kHeight);
  EXPECT_EQ(facts_.format, PixelFormat::kMono8);
  for (std::size_t y = 0; y < kHeight; ++y)
    for (std::size_t x = 0; x < kWidth; ++x) {
      ASSERT_EQ(left_[y * kWidth + x], luma(true, x, y));
      ASSERT_EQ(right_[y * kWidth + x], luma(false, x, y));
    }
  EXPECT_EQ(facts_.exposure_time, 1'700'000'001 * kNsPerSecond);
  // The wall clock is set an hour on: the next frame follows it at once.
  clocks_.epoch += 3600 * kNsPerSecond;
  give(1);
  ASSERT_TRUE(*grab());
  EXPECT_EQ(facts_.exposure_time, 1'700'003'601 * kNsPerSecond + 66'000'000);
}

TEST_F(V4l2DeviceTest, RowsMayBePadded) {
  camera_.padding = 12;
  ASSERT_TRUE(device_->open());
  give(0, yuyv(12));
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_EQ(left_[15 * kWidth + 3], luma(true, 3, 15));
  EXPECT_EQ(right_[15 * kWidth + 31], luma(false, 31, 15));
}

TEST_F(V4l2DeviceTest, Y8IIsTakenApartByteByByte) {
  options_.layout = PairLayout::kInterleavedY8I;
  camera_.format = V4L2_PIX_FMT_Y8I;
  camera_.width = kWidth;
  make();
  ASSERT_TRUE(device_->open());
  std::vector<std::uint8_t> both;
  for (std::size_t y = 0; y < kHeight; ++y)
    for (std::size_t x = 0; x < kWidth; ++x)
      both.insert(both.end(), {luma(true, x, y), luma(false, x, y)});
  give(0, both);
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_EQ(left_[kWidth + 9], luma(true, 9, 1));
  EXPECT_EQ(right_[kWidth + 9], luma(false, 9, 1));
}

TEST_F(V4l2DeviceTest, AJpegPictureIsDecodedAndOneThatIsCutIsCorrupt) {
  options_.layout = PairLayout::kSideBySideJpeg;
  camera_.format = V4L2_PIX_FMT_MJPEG;
  make();
  ASSERT_TRUE(device_->open());
  Image both{2 * kWidth, kHeight, 3, {}};
  for (std::size_t y = 0; y < kHeight; ++y)
    for (std::size_t x = 0; x < 2 * kWidth; ++x)
      both.bytes.insert(both.bytes.end(), 3,
                        x < kWidth ? std::uint8_t(60 + y) : std::uint8_t(160 + y));
  const test::TempFolder folder;
  ASSERT_TRUE(write_image(folder / "both.jpg", both));
  std::ifstream in(folder / "both.jpg", std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in),
                                  std::istreambuf_iterator<char>()};
  give(0, bytes);
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_EQ(facts_.format, PixelFormat::kBgr8);
  EXPECT_NEAR(left_[0], 60, 8);
  EXPECT_NEAR(right_[0], 160, 8);
  // Motion JPEG leaves the standard Huffman tables out, and fills up behind the picture.
  std::vector<std::uint8_t> motion(bytes.begin(), bytes.begin() + 2);
  std::size_t at = 2;
  int tables = 0;
  while (at + 4 < bytes.size() && bytes[at + 1] != 0xDA) {
    const std::size_t length = 2 + std::size_t{bytes[at + 2]} * 256 + bytes[at + 3];
    if (bytes[at + 1] == 0xC4)
      ++tables;
    else
      motion.insert(motion.end(), bytes.begin() + at, bytes.begin() + at + length);
    at += length;
  }
  ASSERT_GT(tables, 0);
  motion.insert(motion.end(), bytes.begin() + at, bytes.end());
  motion.insert(motion.end(), 64, 0);
  give(1, motion);
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_NEAR(right_[0], 160, 8);
  bytes.resize(bytes.size() / 2);
  give(2, bytes);
  expect_refused(Cause::kFrameCorrupt, options_.path);
}

TEST_F(V4l2DeviceTest, TheNewestFrameWinsAndOnlyWhatTheCameraNeverGaveIsMissed) {
  ASSERT_TRUE(device_->open());
  give(10);
  ASSERT_TRUE(*grab());
  EXPECT_EQ(device_->missed(), 0U);
  for (const std::uint32_t n : {11U, 12U, 14U}) give(n);  // 13 was lost on the USB
  ASSERT_TRUE(*grab());
  EXPECT_EQ(facts_.exposure_time, 1'700'000'001 * kNsPerSecond + 14 * 66'000'000);
  EXPECT_EQ(dropped_.of(Cause::kFrameOvertaken), 2U);
  EXPECT_EQ(device_->missed(), 1U);
  EXPECT_EQ(camera_.queued.size(), 4U);
  give(0);  // the driver numbers anew
  ASSERT_TRUE(*grab());
  EXPECT_EQ(device_->missed(), 0U);
}

TEST_F(V4l2DeviceTest, AShortFrameIsCountedAndItsBufferGoesBack) {
  ASSERT_TRUE(device_->open());
  auto bytes = yuyv();
  bytes.pop_back();
  give(0, bytes);
  expect_refused(Cause::kFrameShort, "has 2047 bytes, its rows need 2048");
  give(1);
  ASSERT_TRUE(*grab());
  EXPECT_EQ(device_->remark(), "");
}

TEST_F(V4l2DeviceTest, AFrameThatTheDriverMarksIsRefused) {
  ASSERT_TRUE(device_->open());
  give(0, yuyv(), V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_ERROR);
  expect_refused(Cause::kFrameCorrupt, "marks frames as damaged");
}

TEST_F(V4l2DeviceTest, RowsRepeatedToTheEndAreALostPacketAndOneGreyIsNot) {
  ASSERT_TRUE(device_->open());
  auto bytes = yuyv();
  const std::size_t row = std::size_t{kWidth} * 4;
  for (std::size_t y = 6; y < kHeight; ++y)
    std::copy_n(bytes.begin() + 5 * row, row, bytes.begin() + y * row);
  give(0, bytes);
  expect_refused(Cause::kFrameCorrupt, "repeated rows");
  give(1, std::vector<std::uint8_t>(kHeight * row, 16));  // a dark hall
  EXPECT_TRUE(*grab());
}

TEST_F(V4l2DeviceTest, StampsOfNoClockAreNoExposure) {
  ASSERT_TRUE(device_->open());
  give(0, yuyv(), V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN);
  expect_refused(Cause::kExposureNotLater, "does not say when");
}

TEST_F(V4l2DeviceTest, WhatOpeningMeetsIsSaidWithWhatToDo) {
  camera_.open_error = EACCES;
  expect_open_error(ErrorCode::kResource, "may not open", "group video");
  camera_.open_error = ENOENT;
  expect_open_error(ErrorCode::kNotAvailable, "no camera is there", "plugged in");
  camera_.open_error = 0;
  camera_.query_error = ENOTTY;
  expect_open_error(ErrorCode::kConfiguration, "no video device", "camera.path");
  camera_.query_error = 0;
  camera_.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  expect_open_error(ErrorCode::kConfiguration, "another node", "first node");
  camera_.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  camera_.format_error = EBUSY;
  expect_open_error(ErrorCode::kResource, "another program uses it", "fuser /dev/video0");
  camera_.format_error = 0;
  camera_.stream_error = ENOSPC;
  expect_open_error(ErrorCode::kResource, "no bandwidth", "USB 3 controller");
  device_->close();
  EXPECT_EQ(camera_.opens, camera_.closes);
  EXPECT_EQ(camera_.maps, camera_.unmaps);
}

TEST_F(V4l2DeviceTest, AModeThatIsNotTheOneAskedForIsNamed) {
  camera_.width = 128;
  expect_open_error(ErrorCode::kConfiguration, "does not have 64 x 16 YUYV, it gives 128 x 16 YUYV",
                    "v4l2-ctl --list-formats-ext");
  camera_.width = 64;
  camera_.format = V4L2_PIX_FMT_MJPEG;
  expect_open_error(ErrorCode::kConfiguration, "it gives 64 x 16 MJPG", "camera.width");
  camera_.format = V4L2_PIX_FMT_YUYV;
  camera_.rate_hz = 30;
  expect_open_error(ErrorCode::kConfiguration, "15 frames a second", "camera.rate_hz");
}

TEST_F(V4l2DeviceTest, ExposureAndGainAreSetWithinTheirLimits) {
  options_.exposure = 120;
  options_.gain = 7;
  make();
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(camera_.controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(camera_.controls[V4L2_CID_EXPOSURE_ABSOLUTE], 120);
  EXPECT_EQ(camera_.controls[V4L2_CID_GAIN], 7);
  camera_.has_gain = false;
  expect_open_error(ErrorCode::kConfiguration, "has no gain", "leave gain and brightness");
  options_.exposure = 5000;
  make();
  expect_open_error(ErrorCode::kConfiguration, "exposure 5000 is not within its 1 .. 500",
                    "change exposure");
}

TEST_F(V4l2DeviceTest, ADarkHallIsMadeBrighterByGainOnceExposureIsAtWhatMotionAllows) {
  options_.exposure = 40;
  options_.brightness = 110;
  make();
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(camera_.controls[V4L2_CID_EXPOSURE_ABSOLUTE], 40);
  EXPECT_EQ(camera_.controls[V4L2_CID_GAIN], 1);
  for (std::uint32_t n = 0; n < BrightnessControl::kSettle; ++n) {
    give(n, std::vector<std::uint8_t>(kHeight * kWidth * 4, 30));
    ASSERT_TRUE(*grab());
  }
  EXPECT_EQ(camera_.controls[V4L2_CID_EXPOSURE_ABSOLUTE], 40);
  EXPECT_EQ(camera_.controls[V4L2_CID_GAIN], 1 + 499 / 32);
}

class ZedTest : public V4l2DeviceTest {
 protected:
  ZedTest() {
    camera_.card = "ZED 2: ZED 2";
    camera_.unit_bytes = 384;
    options_.exposure = 40;  // 4 ms
    options_.gain = 50;
    make();
  }
  int sensor(std::uint8_t eye, std::uint32_t address) {
    return camera_.registers[{eye, address}] << 16 | camera_.registers[{eye, address + 1}] << 8 |
           camera_.registers[{eye, address + 2}];
  }
};

TEST_F(ZedTest, ExposureAndGainAreSetInTheRegistersOfBothEyesOnUsb3AndUsb2) {
  for (const std::uint16_t bytes : {std::uint16_t{384}, std::uint16_t{64}}) {
    camera_.unit_bytes = bytes;
    camera_.registers.clear();
    camera_.registers[{0xA2, 0x80181033}] = camera_.registers[{0xA2, 0x80181833}] = 0xFF;
    ASSERT_TRUE(device_->open());
    EXPECT_EQ((camera_.registers[{0xA2, 0x80181033}]), 0xFD) << "only the automatic is off";
    EXPECT_EQ((camera_.registers[{0xA2, 0x80181833}]), 0xFD);
    for (const std::uint8_t eye : {std::uint8_t{0xA3}, std::uint8_t{0xA5}}) {
      // 4 ms of 66.7 are 93 of 1550 lines, in sixteenths of a line.
      EXPECT_EQ(sensor(eye, 0x3500), 93 << 4);
      EXPECT_EQ(sensor(eye, 0x3507), 450) << "half of the 658 values that there are";
    }
    EXPECT_FALSE(camera_.controls.contains(V4L2_CID_EXPOSURE_ABSOLUTE));
  }
}

TEST_F(ZedTest, NothingIsTouchedWhereNothingIsToBeSet) {
  options_.exposure.reset();
  options_.gain.reset();
  make();
  ASSERT_TRUE(device_->open());
  EXPECT_EQ((camera_.registers[{0xA2, 0x80181033}]), 0xFF);
}

TEST_F(ZedTest, WhatItCannotDoIsSaid) {
  options_.exposure = 5000;
  make();
  expect_open_error(ErrorCode::kConfiguration, "exposure 5000 is not within its 0 .. 666 at 15 Hz",
                    "change exposure_100us");
  options_.exposure = 40;
  options_.gain = 101;
  make();
  expect_open_error(ErrorCode::kConfiguration, "gain 101 is not within its 0 .. 100", "gain");
  options_.gain = 5;
  make();
  camera_.deaf_right_eye = true;
  expect_open_error(ErrorCode::kResource, "the right eye does not take", "firmware");
  camera_.deaf_right_eye = false;
  camera_.unit_bytes = 0;
  expect_open_error(ErrorCode::kConfiguration, "has not the ZED's registers", "leave exposure");
}

TEST_F(ZedTest, ACommandThatFailsIsTriedThreeTimes) {
  camera_.unit_fails = 2;
  ASSERT_TRUE(device_->open());
  camera_.unit_fails = 3;
  expect_open_error(ErrorCode::kResource, "setting exposure or gain failed", "unplug");
}

TEST_F(ZedTest, ADarkHallIsMadeBrighterByItsGain) {
  options_.gain.reset();
  options_.brightness = 110;
  make();
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(sensor(0xA3, 0x3507), 0);
  for (std::uint32_t n = 0; n < BrightnessControl::kSettle; ++n) {
    give(n, std::vector<std::uint8_t>(kHeight * kWidth * 4, 30));
    ASSERT_TRUE(*grab());
  }
  EXPECT_GT(sensor(0xA3, 0x3507), 0);
  EXPECT_EQ(sensor(0xA3, 0x3507), sensor(0xA5, 0x3507));
  EXPECT_EQ(sensor(0xA3, 0x3500), 93 << 4);
}

TEST_F(V4l2DeviceTest, UnpluggedIsAnErrorAndAnotherOpenWorks) {
  ASSERT_TRUE(device_->open());
  give(0);
  ASSERT_TRUE(*grab());
  for (const int error : {ENODEV, EIO}) {
    camera_.dequeue_error = error;
    const auto got = grab();
    ASSERT_FALSE(got);
    EXPECT_NE(got.error().code, ErrorCode::kConfiguration) << "it is tried again";
    EXPECT_FALSE(got.error().todo.empty());
    device_->close();
    camera_.dequeue_error = 0;
    ASSERT_TRUE(device_->open());
    give(0);
    EXPECT_TRUE(*grab());
  }
}

/// The rig's pairs, seen by a camera that swaps its halves now and then.
TEST(HalvesSwapped, AreFoundOnRealScenesAndNeverClaimedWhereNothingTells) {
  namespace fs = std::filesystem;
  std::size_t seen = 0;
  for (const auto& entry : fs::directory_iterator(test::rig_recording() + "/cam0/data")) {
    const fs::path other = fs::path(test::rig_recording()) / "cam1/data" / entry.path().filename();
    const auto left = read_image(entry.path(), 1U << 20U);
    const auto right = read_image(other, 1U << 20U);
    ASSERT_TRUE(left && right);
    const auto swapped = [](const Image& a, const Image& b) {
      return halves_swapped(a.bytes.data(), b.bytes.data(), a.width, a.height, a.channels);
    };
    EXPECT_FALSE(swapped(*left, *right)) << entry.path();
    EXPECT_TRUE(swapped(*right, *left)) << entry.path();
    EXPECT_FALSE(swapped(*left, *left));
    ++seen;
  }
  EXPECT_EQ(seen, 6U);
  std::mt19937 random(3);  // noise, and a floor without anything on it
  std::vector<std::uint8_t> a(640 * 480), b = a;
  EXPECT_FALSE(halves_swapped(a.data(), b.data(), 640, 480, 1));
  for (auto* image : {&a, &b})
    for (std::uint8_t& p : *image) p = static_cast<std::uint8_t>(random() % 256);
  EXPECT_FALSE(halves_swapped(a.data(), b.data(), 640, 480, 1));
}

TEST_F(V4l2DeviceTest, SwappedHalvesAreRefusedAndACameraWiredThatWayIsSwappedBack) {
  namespace fs = std::filesystem;
  const fs::path file = *fs::directory_iterator(test::rig_recording() + "/cam0/data");
  const auto left = read_image(file, 1U << 20U);
  const auto right =
      read_image(fs::path(test::rig_recording()) / "cam1/data" / file.filename(), 1U << 20U);
  ASSERT_TRUE(left && right);
  std::vector<std::uint8_t> bytes;
  for (std::uint32_t y = 0; y < left->height; ++y)
    for (const Image* image : {&*right, &*left})  // the other way round
      for (std::uint32_t x = 0; x < image->width; ++x)
        bytes.insert(bytes.end(),
                     {image->bytes[(std::size_t{y} * image->width + x) * image->channels], 128});
  camera_.width = 2 * left->width;
  camera_.height = left->height;
  options_.width = left->width;
  options_.height = left->height;
  left_.resize(std::size_t{left->width} * left->height);
  right_ = left_;
  make();
  ASSERT_TRUE(device_->open());
  give(0, bytes);
  expect_refused(Cause::kHalvesSwapped, "camera.swap");
  options_.swap = true;
  make();
  ASSERT_TRUE(device_->open());
  give(1, bytes);
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_EQ(left_[500], left->bytes[500 * left->channels]);
}

}  // namespace
}  // namespace crane
