// SPDX-License-Identifier: Apache-2.0
// Two cameras by Aravis, its own fakes, in a network of their own: through the real service and
// DDS to a subscriber.

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>
#include <list>
#include <optional>
#include <set>

#include "base/clock.hpp"
#include "dds/endpoints.hpp"
#include "dds/participant.hpp"
#include "own_network.hpp"
#include "system/process.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kFake = "/usr/bin/arv-fake-gv-camera-0.8";
constexpr std::uint32_t kWidth = 320, kHeight = 240;

struct Seen {
  std::uint64_t stream = 0, number = 0;
  TimeNs time = 0, arrival = 0;
  std::uint32_t width = 0, height = 0, encoding = 0;
  std::vector<std::uint8_t> left, right;
};

class Genicam : public ::testing::Test {
 protected:
  void SetUp() override {
    if (access(kFake, X_OK) != 0) GTEST_SKIP() << "no aravis-tools here";
    if (!own_network({"127.0.0.1", "127.0.0.2", "127.0.0.3"}))
      GTEST_SKIP() << "this machine makes no network namespaces";
    dds::Settings settings;
    settings.domain = static_cast<std::uint32_t>(std::stoi(domain_));
    participant_ = *dds::Participant::create(settings, "test");
    reader_.emplace(*dds::Reader<dds::StereoFrameTopic>::create(participant_, nullptr));
  }
  Process& fake(int n, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = {kFake, "-i", "127.0.0." + std::to_string(n), "-s",
                                        "GV0" + std::to_string(n)};
    command.insert(command.end(), more.begin(), more.end());
    return processes_.emplace_back(command, folder_ / ("fake" + std::to_string(n)));
  }
  Process& camera(const std::string& more) {
    std::ofstream(folder_ / "site.yaml") << "dds: {domain: " << domain_ << "}\nhttp: {port: 0}\n"
                                         << "camera: {source: genicam, width: " << kWidth
                                         << ", height: " << kHeight << ", " << more << "}\n";
    return processes_.emplace_back(
        std::vector<std::string>{"cranemap-camera", "--config", folder_ / "site.yaml"},
        folder_ / "camera.txt");
  }
  /// The next frame; of another stream than `not_of`, if that is said.
  std::optional<Seen> next(std::uint64_t not_of = 0) {
    std::optional<Seen> out;
    eventually(30s, [&] {
      while (auto sample = reader_->take()) {
        const auto& f = **sample;
        if (f.stream() == not_of) continue;
        const std::size_t size = std::size_t{f.width()} * f.height();
        out = Seen{f.stream(),
                   f.sequence_number(),
                   f.exposure_time_ns(),
                   SystemClock().now(),
                   f.width(),
                   f.height(),
                   f.encoding(),
                   {f.left().data(), f.left().data() + size},
                   {f.right().data(), f.right().data() + size}};
        if (sample->intact()) return true;
        out.reset();
      }
      return false;
    });
    return out;
  }
  static void expect_good(const Seen& f) {
    EXPECT_EQ(f.width, kWidth);
    EXPECT_EQ(f.height, kHeight);
    EXPECT_EQ(f.encoding, v1::ENCODING_MONO8);
    EXPECT_LT(f.time, f.arrival);
    EXPECT_GT(f.time, f.arrival - 20 * kNsPerSecond);
    // The fake's picture depends on x + y: a row is the one above, one pixel further.
    for (const auto* image : {&f.left, &f.right})
      for (std::size_t y = 1; y < kHeight; ++y)
        for (std::size_t x = 0; x + 1 < kWidth; ++x)
          ASSERT_EQ((*image)[y * kWidth + x], (*image)[(y - 1) * kWidth + x + 1]) << x << " " << y;
    for (const auto* image : {&f.left, &f.right})
      EXPECT_GT(std::set(image->begin(), image->end()).size(), 20U);
  }

  TempFolder folder_;
  std::string domain_ = next_domain();
  std::shared_ptr<dds::Participant> participant_;
  std::optional<dds::Reader<dds::StereoFrameTopic>> reader_;
  std::list<Process> processes_;
};

TEST_F(Genicam, TwoCamerasAreOneAndOneThatIsSwitchedOffAndOnBeginsANewStream) {
  Process& service = camera(
      "path: 127.0.0.2, right: 127.0.0.3, rate_hz: 10, pair_within_ms: 49, exposure_100us: 50, "
      "gain: 3");
  EXPECT_TRUE(eventually(20s, [&] {  // before there are cameras
    return service.output().find("no such camera answers") != std::string::npos;
  })) << service.output();
  fake(2);
  Process& right = fake(3);
  const auto first = next();
  ASSERT_TRUE(first) << service.output();
  expect_good(*first);
  std::optional<Seen> last = first;
  for (int n = 0; n < 5; ++n) {
    const auto frame = next();
    ASSERT_TRUE(frame) << service.output();
    EXPECT_EQ(frame->stream, first->stream);
    EXPECT_GT(frame->number, last->number);
    EXPECT_GT(frame->time, last->time);
    last = frame;
  }
  expect_good(*last);
  EXPECT_NE(service.output().find("camera: connected; left camera: 127.0.0.2: stamped by"),
            std::string::npos)
      << service.output();
  right.signal(SIGKILL);
  right.wait(5);
  EXPECT_TRUE(eventually(30s, [&] {
    return service.output().find("127.0.0.3: does not answer any more") != std::string::npos ||
           service.output().find(
               "no usable pair for 5 s although it is connected; the last: only "
               "the left camera") != std::string::npos;
  })) << service.output();
  fake(3);
  const auto again = next(first->stream);
  ASSERT_TRUE(again) << service.output();
  expect_good(*again);
  EXPECT_EQ(again->number, 0U);
  service.signal(SIGTERM);
  EXPECT_EQ(service.wait(10), 0) << service.output();
}

TEST_F(Genicam, TwoCamerasThatAreToldWhenTakeTheirPicturesTogether) {
  fake(2);
  fake(3);
  Process& service =
      camera("path: 127.0.0.2, right: 127.0.0.3, trigger: software, rate_hz: 20, pair_by: number");
  std::optional<Seen> last = next();
  ASSERT_TRUE(last) << service.output();
  expect_good(*last);
  for (int n = 0; n < 5; ++n) {
    const auto frame = next();
    ASSERT_TRUE(frame) << service.output();
    EXPECT_EQ(frame->stream, last->stream);
    EXPECT_GT(frame->time, last->time);
    last = frame;
  }
  service.signal(SIGTERM);
  EXPECT_EQ(service.wait(20), 0) << service.output();
}

TEST_F(Genicam, OneCameraThatGivesBothImagesRunsFreelyAndLostPacketsAreCounted) {
  fake(2, {"-r", "2"});  // of a thousand
  Process& service = camera("path: Aravis-GV02, rate_hz: 30, layout: grey");
  const auto first = next();
  ASSERT_TRUE(first) << service.output();
  EXPECT_EQ(first->width, kWidth);
  EXPECT_TRUE(eventually(30s, [&] {
    return service.output().find("packets of pictures get lost") != std::string::npos;
  })) << service.output();
  const auto another = next();
  ASSERT_TRUE(another) << service.output();
  EXPECT_EQ(another->stream, first->stream);
}

TEST_F(Genicam, WhatACameraCannotDoEndsTheServiceWithWhatToChange) {
  fake(2);
  struct Case {
    const char* camera;
    const char* said;
  };
  for (const Case& c :
       {Case{"path: 127.0.0.2, rate_hz: 10, pixel_format: Mono16", "set camera.pixel_format"},
        Case{"path: 127.0.0.2, rate_hz: 10, exposure_100us: 100000, gain: 99",
             "GainRaw 99 is not within its 0 .. 10"},
        Case{"path: 127.0.0.2, rate_hz: 10, stamps: chunk", "set camera.stamps: camera"},
        Case{"path: 127.0.0.2, rate_hz: 10, ptp: true", "leave camera.ptp out"}}) {
    Process& service = camera(c.camera);
    EXPECT_EQ(service.wait(20), 2) << service.output();
    EXPECT_NE(service.output().find(c.said), std::string::npos) << service.output();
  }
}

}  // namespace
}  // namespace crane::test
