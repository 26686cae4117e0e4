// SPDX-License-Identifier: Apache-2.0
// Pipelines by the real GStreamer, loaded as cranemap-camera loads it.

#include <gst/rtsp-server/rtsp-server.h>
#include <gtest/gtest.h>

#include <thread>

#include "sensors/camera/load_module.hpp"
#include "sensors/camera/pipeline_device.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kWidth = 32, kHeight = 32;
const std::string kMode = "video/x-raw,width=64,height=32,framerate=20/1";

class GStreamer : public ::testing::Test {
 protected:
  void make(const std::string& pipeline, bool for_viewing = false) {
    auto io = load_gstreamer();
    ASSERT_TRUE(io) << io.error().text();
    PipelineOptions o;
    o.pipeline = pipeline;
    o.width = kWidth;
    o.height = kHeight;
    o.for_viewing = for_viewing;
    device_ = std::make_unique<PipelineDevice>(o, std::move(*io));
  }
  /// Until a pair, an error, or one that is refused, at most 20 s.
  Result<bool> grab() {
    for (const auto end = std::chrono::steady_clock::now() + 20s;
         std::chrono::steady_clock::now() < end;) {
      auto got = device_->grab({left_.data(), right_.data(), left_.size(), kWidth * kHeight},
                               facts_, std::chrono::steady_clock::now() + 50ms, dropped_);
      if (!got || *got || !device_->remark().empty()) return got;
    }
    return Error{ErrorCode::kNotAvailable, "test", "nothing came", ""};
  }
  void expect_open_error(ErrorCode code, const std::string& what, const std::string& todo) {
    const auto opened = device_->open();
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, code) << opened.error().text();
    EXPECT_NE(opened.error().what.find(what), std::string::npos) << opened.error().text();
    EXPECT_NE(opened.error().todo.find(todo), std::string::npos) << opened.error().text();
  }
  void expect_refused_for_its_time() {
    const auto got = grab();
    ASSERT_TRUE(got) << got.error().text();
    EXPECT_FALSE(*got);
    EXPECT_GE(dropped_.of(Cause::kNoCaptureTime), 1U);
    EXPECT_NE(device_->remark().find("camera.for_viewing: true"), std::string::npos);
    EXPECT_FALSE(device_->reconnects_when_silent());
  }

  std::unique_ptr<PipelineDevice> device_;
  std::vector<std::uint8_t> left_ = std::vector<std::uint8_t>(kWidth * kHeight * 3), right_ = left_;
  FrameFacts facts_;
  DropCounts dropped_;
};

TEST_F(GStreamer, ALiveSourceOfThisHostIsStampedByItsClock) {
  make("videotestsrc is-live=true pattern=gradient ! " + kMode + ",format=GRAY8 ! appsink");
  ASSERT_TRUE(device_->open());
  TimeNs last = 0;
  for (int n = 0; n < 5; ++n) {
    const auto got = grab();
    ASSERT_TRUE(got && *got) << device_->remark();
    EXPECT_EQ(facts_.width, kWidth);
    EXPECT_EQ(facts_.height, kHeight);
    EXPECT_EQ(facts_.format, PixelFormat::kMono8);
    const TimeNs now = SystemClock().now();
    EXPECT_LE(facts_.exposure_time, now);
    EXPECT_GT(facts_.exposure_time, now - 15 * kNsPerSecond);
    EXPECT_GT(facts_.exposure_time, last);
    last = facts_.exposure_time;
  }
  EXPECT_NE(device_->about().find("live source"), std::string::npos) << device_->about();
  EXPECT_EQ(left_[kWidth * 5], right_[kWidth * 5]);
  EXPECT_NE(left_[0], left_[kWidth * 31]) << "a gradient from the top";
}

TEST_F(GStreamer, ColourComesAsItIs) {
  make("videotestsrc is-live=true pattern=red ! " + kMode + ",format=RGB ! appsink");
  ASSERT_TRUE(device_->open());
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_EQ(facts_.format, PixelFormat::kRgb8);
  EXPECT_EQ((std::vector<std::uint8_t>(right_.begin(), right_.begin() + 3)),
            (std::vector<std::uint8_t>{255, 0, 0}));
}

TEST_F(GStreamer, WhatIsNotLiveDoesNotSayWhenItWasTakenAndIsForViewingOnly) {
  const std::string file = "videotestsrc ! " + kMode + ",format=GRAY8 ! appsink";
  make(file);
  ASSERT_TRUE(device_->open());
  expect_refused_for_its_time();
  make(file, true);
  ASSERT_TRUE(device_->open());
  ASSERT_TRUE(*grab()) << device_->remark();
  EXPECT_NE(device_->about().find("for viewing only"), std::string::npos);
}

TEST_F(GStreamer, AModeOfAnotherSizeIsSaidWithBoth) {
  make("videotestsrc is-live=true ! video/x-raw,width=80,height=32 ! appsink");
  ASSERT_TRUE(device_->open());
  ASSERT_FALSE(*grab());
  EXPECT_EQ(dropped_.of(Cause::kFrameShort), 1U);
  EXPECT_NE(device_->remark().find("gives 80 x 32 pixels, both images side by side are 64 x 32"),
            std::string::npos)
      << device_->remark();
}

TEST_F(GStreamer, WhatIsNoPipelineOfOursIsTheConfigurationsFault) {
  make("nosuchsource ! appsink");
  expect_open_error(ErrorCode::kConfiguration, "nosuchsource", "gst-inspect-1.0");
  make("videotestsrc ! ! appsink");
  expect_open_error(ErrorCode::kConfiguration, "is no pipeline", "gst-launch-1.0");
  make("videotestsrc ! fakesink");
  expect_open_error(ErrorCode::kConfiguration, "does not end in one appsink", "videoconvert");
  make("videotestsrc ! appsink videotestsrc ! appsink");
  expect_open_error(ErrorCode::kConfiguration, "does not end in one appsink", "videoconvert");
  make("appsink");
  expect_open_error(ErrorCode::kConfiguration, "does not end in one appsink", "videoconvert");
}

TEST_F(GStreamer, ErrorsNameTheElementAndWhatToDo) {
  make("v4l2src device=/dev/no-such-video name=eye ! appsink");
  expect_open_error(ErrorCode::kNotAvailable, "element eye", "is the camera on");
  make("filesrc location=/no/such/file ! pngdec ! videoconvert ! appsink");
  expect_open_error(ErrorCode::kNotAvailable, "No such file", "is the camera on");
  make("audiotestsrc is-live=true ! appsink");
  EXPECT_FALSE(device_->open());
}

TEST_F(GStreamer, TheEndOfAPipelineIsALostCamera) {
  make("videotestsrc num-buffers=2 ! " + kMode + ",format=GRAY8 ! appsink", true);
  ASSERT_TRUE(device_->open());
  Result<bool> got = true;
  for (int n = 0; n < 3 && got; ++n) got = grab();
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().code, ErrorCode::kNotAvailable);
  EXPECT_NE(got.error().what.find("has come to its end"), std::string::npos);
  device_->close();
  ASSERT_TRUE(device_->open()) << "and is connected again";
  EXPECT_TRUE(*grab());
}

/// An RTSP camera on this host.
class RtspCamera {
 public:
  RtspCamera() : loop_(g_main_loop_new(g_main_context_default(), FALSE)) {
    gst_init(nullptr, nullptr);
    server_ = gst_rtsp_server_new();
    gst_rtsp_server_set_address(server_, "127.0.0.1");
    gst_rtsp_server_set_service(server_, "0");
    GstRTSPMountPoints* mounts = gst_rtsp_server_get_mount_points(server_);
    GstRTSPMediaFactory* factory = gst_rtsp_media_factory_new();
    gst_rtsp_media_factory_set_launch(factory,
                                      ("( videotestsrc is-live=true ! " + kMode +
                                       ",format=I420 ! jpegenc ! rtpjpegpay name=pay0 pt=26 )")
                                          .c_str());
    gst_rtsp_mount_points_add_factory(mounts, "/pair", factory);
    g_object_unref(mounts);
    source_ = gst_rtsp_server_attach(server_, nullptr);
    thread_ = std::thread([this] { g_main_loop_run(loop_); });
  }
  ~RtspCamera() {
    g_main_loop_quit(loop_);
    thread_.join();
    g_source_remove(source_);
    g_object_unref(server_);
    g_main_loop_unref(loop_);
  }
  RtspCamera(const RtspCamera&) = delete;
  RtspCamera& operator=(const RtspCamera&) = delete;
  [[nodiscard]] std::string source(const std::string& more) const {
    return "rtspsrc location=rtsp://127.0.0.1:" +
           std::to_string(gst_rtsp_server_get_bound_port(server_)) + "/pair latency=50 " + more +
           " ! rtpjpegdepay ! jpegdec ! videoconvert ! appsink";
  }

 private:
  GMainLoop* loop_;
  GstRTSPServer* server_ = nullptr;
  guint source_ = 0;
  std::thread thread_;
};

TEST_F(GStreamer, ANetworkCameraIsMappedWithOnlyWhereItTellsItsClock) {
  const RtspCamera camera;
  make(camera.source(""));
  ASSERT_TRUE(device_->open());
  expect_refused_for_its_time();
  device_->close();
  make(camera.source("add-reference-timestamp-meta=true"));
  ASSERT_TRUE(device_->open());
  // Its first sender report may take some seconds; what comes before is refused.
  bool got = false;
  for (const auto end = std::chrono::steady_clock::now() + 30s;
       !got && std::chrono::steady_clock::now() < end;) {
    const auto answer = grab();
    ASSERT_TRUE(answer) << answer.error().text();
    got = *answer;
  }
  ASSERT_TRUE(got) << device_->remark();
  const TimeNs now = SystemClock().now();
  EXPECT_LE(facts_.exposure_time, now);
  EXPECT_GT(facts_.exposure_time, now - 10 * kNsPerSecond);
  EXPECT_NE(device_->about().find("sender reports"), std::string::npos) << device_->about();
}

TEST_F(GStreamer, ACameraThatIsNotThereIsSaid) {
  make("rtspsrc location=rtsp://127.0.0.1:1/none ! rtpjpegdepay ! jpegdec ! appsink");
  auto opened = device_->open();
  if (opened) opened = grab() ? Result<void>{} : Error{ErrorCode::kNotAvailable, "", "", ""};
  EXPECT_FALSE(opened);
}

}  // namespace
}  // namespace crane
