// SPDX-License-Identifier: Apache-2.0
// Recordings of what goes on: exact, whole at any moment, and never larger than they may be.

#include "recording/recording_sink.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "imaging/convert.hpp"
#include "recording/recording.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

namespace fs = std::filesystem;
using Sensor = RecordingSink::Sensor;

constexpr TimeNs kStart = 1'700'000'000'000'000'000;

StereoRig rig() {
  return *read_rig(rig_recording());
}

Image image(std::uint8_t seed) {
  Image out{64, 48, 1, std::vector<std::uint8_t>(64 * 48)};
  for (std::size_t i = 0; i < out.bytes.size(); ++i)
    out.bytes[i] = static_cast<std::uint8_t>((i + seed) * 2'654'435'761U >> 13U);
  return out;
}

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

RecordingSink sink_in(const std::string& folder, SinkOptions options = {}) {
  options.folder = folder;
  auto sink = RecordingSink::create(options, rig(), 10, {});
  EXPECT_TRUE(sink) << (sink ? "" : sink.error().text());
  return std::move(*sink);
}

void add_positions(RecordingSink& sink, TimeNs time) {
  EXPECT_TRUE(sink.add_distance(Sensor::kCart, time, 1.0 / 3, 0.002));
  EXPECT_TRUE(sink.add_distance(Sensor::kTrolley, time, 0.1 + 0.2, 0.002));
}

/// While it lives no file of this process grows beyond so many bytes: a disk that is full.
class SmallFiles {
 public:
  explicit SmallFiles(rlim_t bytes) {
    before_ = signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit small{bytes, old_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallFiles() {
    setrlimit(RLIMIT_FSIZE, &old_);
    signal(SIGXFSZ, before_);
  }
  SmallFiles(const SmallFiles&) = delete;
  SmallFiles& operator=(const SmallFiles&) = delete;

 private:
  rlimit old_{};
  sighandler_t before_ = nullptr;
};

TEST(RecordingSink, WhatItWroteIsReadBackExactly) {
  const TempFolder folder;
  RecordingSink sink = sink_in(folder / "rec");
  add_positions(sink, kStart);
  ASSERT_TRUE(sink.add_distance(Sensor::kCart, kStart + 50, std::nan(""), 0.002));
  HoistReading hoist;
  hoist.time = kStart + 7;
  hoist.hook_height_m = 1.0 / 7;
  hoist.load_size_m = {0.1, 0.2, 0.3};
  ASSERT_TRUE(sink.add_hoist(hoist));
  const Image left = image(3), right = image(4);
  ASSERT_TRUE(sink.add_frame(kStart + 20, left, right));
  ASSERT_TRUE(sink.flush());
  const auto recording = Recording::open(folder / "rec");
  ASSERT_TRUE(recording) << recording.error().text();
  ASSERT_EQ(recording->frames().size(), 1U);
  EXPECT_EQ(read_image(recording->frames()[0].left_file, 1'000'000)->bytes, left.bytes);
  EXPECT_EQ(read_image(recording->frames()[0].right_file, 1'000'000)->bytes, right.bytes);
  EXPECT_EQ(recording->cart()[0].distance_m, 1.0 / 3);
  EXPECT_TRUE(std::isnan(recording->cart()[1].distance_m));
  EXPECT_EQ(recording->trolley()[0].distance_m, 0.1 + 0.2);
  EXPECT_EQ(recording->cart_model().accuracy_m, 0.002);
  EXPECT_EQ(recording->hoist()[0].hook_height_m, 1.0 / 7);
  EXPECT_TRUE(recording->cart_second().empty());
}

/// A camera of 12 bits: every bit is in the files, and what is made of them is what was made live.
TEST(RecordingSink, KeepsEveryBitOfADeepGreyCamera) {
  constexpr std::uint32_t kWide = 32, kHigh = 16;
  for (const auto& [format, bits] :
       {std::pair{PixelFormat::kMono10p, 10U}, std::pair{PixelFormat::kMono12p, 12U}}) {
    const TempFolder folder;
    RecordingSink sink = sink_in(folder / "rec");
    add_positions(sink, kStart);
    std::vector<std::uint16_t> values(kWide * kHigh);
    std::vector<std::uint8_t> packed(values.size() * bits / 8);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<std::uint16_t>(i * 2477 % (1U << bits));
      for (std::size_t b = 0; b < bits; ++b)
        if (values[i] >> b & 1U)
          packed[(i * bits + b) / 8] =
              static_cast<std::uint8_t>(packed[(i * bits + b) / 8] | 1U << (i * bits + b) % 8);
    }
    const ImageView view{format, kWide, kHigh, packed};
    const auto deep = to_deep(view);
    ASSERT_TRUE(deep) << deep.error().text();
    EXPECT_EQ(deep->values, values);
    ASSERT_TRUE(sink.add_frame(kStart + 20, *deep, *deep));
    DeepImage other = *deep;
    other.bits = 14;
    EXPECT_FALSE(sink.add_frame(kStart + 30, other, other));
    ASSERT_TRUE(sink.flush());
    const auto recording = Recording::open(folder / "rec");
    ASSERT_TRUE(recording) << recording.error().text();
    EXPECT_EQ(recording->rig().left.bits, int(bits));
    const std::string file = recording->frames().at(0).left_file;
    const cv::Mat stored = cv::imread(file, cv::IMREAD_UNCHANGED);
    ASSERT_EQ(stored.type(), CV_16UC1);
    EXPECT_TRUE(std::equal(values.begin(), values.end(), stored.ptr<std::uint16_t>()));
    std::vector<std::uint8_t> live;
    ASSERT_TRUE(to_grey(view, live));
    EXPECT_EQ(read_image(file, 1'000'000, int(bits))->bytes, live);
  }
  const std::vector<std::uint8_t> bytes(64);
  EXPECT_FALSE(to_deep({PixelFormat::kMono8, 8, 8, bytes}));
  EXPECT_FALSE(to_deep({PixelFormat::kMono12p, 8, 8, bytes}));
}

TEST(RecordingSink, RefusesAFolderThatHoldsSomething) {
  const TempFolder folder;
  std::ofstream(folder / "mine.txt") << "x";
  const auto sink = RecordingSink::create({.folder = folder.path().string()}, rig(), 10, {});
  ASSERT_FALSE(sink);
  EXPECT_EQ(sink.error().code, ErrorCode::kConfiguration);
  EXPECT_TRUE(fs::exists(folder / "mine.txt"));
}

TEST(RecordingSink, ARingKeepsTheLastSecondsAndTheirPositionsAndNoOtherImages) {
  const TempFolder folder;
  SinkOptions options;
  options.ring = 3 * kNsPerSecond;
  RecordingSink sink = sink_in(folder / "rec", options);
  for (int second = 0; second < 20; ++second) {
    const TimeNs time = kStart + second * kNsPerSecond;
    add_positions(sink, time);
    ASSERT_TRUE(sink.add_frame(time, image(1), image(2)));
    ASSERT_TRUE(sink.flush());
    const auto recording = Recording::open(folder / "rec");
    ASSERT_TRUE(recording) << recording.error().text();
    EXPECT_EQ(recording->frames().size(), std::min<std::size_t>(4, std::size_t(second) + 1));
    EXPECT_EQ(recording->frames().back().time, time);
  }
  const auto recording = Recording::open(folder / "rec");
  EXPECT_EQ(recording->cart().front().time, kStart + 14 * kNsPerSecond);
  const fs::directory_iterator images(folder / "rec/cam0/data");
  EXPECT_EQ(std::distance(fs::begin(images), fs::end(images)), 4);
}

TEST(RecordingSink, ALimitOfSizeEndsARecordingAndMakesARingGiveUpItsOldest) {
  const TempFolder folder;
  SinkOptions options;
  options.max_bytes = 20'000;
  RecordingSink sink = sink_in(folder / "all", options);
  int added = 0;
  while (!sink.full() && added < 1000)
    ASSERT_TRUE(sink.add_frame(kStart + ++added * kNsPerSecond, image(1), image(2)));
  EXPECT_LT(added, 1000);
  EXPECT_GE(sink.bytes(), 20'000U);
  options.ring = 1000 * kNsPerSecond;
  RecordingSink ring = sink_in(folder / "ring", options);
  for (int n = 0; n < 2 * added; ++n) {
    ASSERT_TRUE(ring.add_frame(kStart + n * kNsPerSecond, image(1), image(2)));
    ASSERT_TRUE(ring.flush());
    EXPECT_LE(ring.bytes(), 20'000U);
  }
  EXPECT_FALSE(ring.full());
}

TEST(RecordingSink, OnADiskThatIsFullAFrameLeavesNothingBehindAndLinesAreWholeAndComeLater) {
  const TempFolder folder;
  RecordingSink sink = sink_in(folder / "rec");
  add_positions(sink, kStart);
  ASSERT_TRUE(sink.add_frame(kStart + 1, image(1), image(2)));
  ASSERT_TRUE(sink.flush());
  const std::string before = text_of(folder / "rec/cart0/data.csv");
  for (int i = 1; i <= 100; ++i) add_positions(sink, kStart + i * 10);
  {
    const SmallFiles full(before.size() + 100);
    const auto refused = sink.add_frame(kStart + 2, image(1), image(2));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kResource);
    EXPECT_FALSE(sink.flush());
    EXPECT_EQ(text_of(folder / "rec/cart0/data.csv"), before) << "no half lines";
  }
  EXPECT_EQ(sink.frames(), 1U);
  for (const char* camera : {"cam0", "cam1"})
    EXPECT_FALSE(fs::exists(fs::path(folder / "rec") / camera / "data" /
                            (std::to_string(kStart + 2) + ".png")));
  ASSERT_TRUE(sink.flush()) << "there is room again";
  const auto recording = Recording::open(folder / "rec");
  ASSERT_TRUE(recording) << recording.error().text();
  EXPECT_EQ(recording->cart().size(), 101U);
  EXPECT_EQ(recording->frames().size(), 1U);
}

}  // namespace
}  // namespace crane::test
