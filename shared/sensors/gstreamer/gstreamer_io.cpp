// SPDX-License-Identifier: Apache-2.0
#include "sensors/gstreamer/gstreamer_io.hpp"

#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <utility>

#include "sensors/gstreamer/capture_time.hpp"
#include "sensors/gstreamer/pipeline_error.hpp"

namespace crane {
namespace {

constexpr const char* kName = "camera.pipeline";
constexpr const char* kCaps = "video/x-raw, format = (string) { GRAY8, BGR, RGB, YUY2, UYVY }";
constexpr GstClockTime kStart = 3 * GST_SECOND;
constexpr guint kBuffers = 4;

std::optional<RawFormat> format_of(GstVideoFormat format) {
  switch (format) {
    case GST_VIDEO_FORMAT_GRAY8:
      return RawFormat{PixelFormat::kMono8};
    case GST_VIDEO_FORMAT_BGR:
      return RawFormat{PixelFormat::kBgr8};
    case GST_VIDEO_FORMAT_RGB:
      return RawFormat{PixelFormat::kRgb8};
    case GST_VIDEO_FORMAT_YUY2:
      return RawFormat{PixelFormat::kYuyv};
    case GST_VIDEO_FORMAT_UYVY:
      return RawFormat{PixelFormat::kYuyv, true};
    default:
      return std::nullopt;
  }
}

class GStreamer final : public PipelineIo {
 public:
  ~GStreamer() override { GStreamer::close(); }

  Result<void> open(const std::string& text) override {
    close();
    GError* error = nullptr;
    if (gst_init_check(nullptr, nullptr, &error) == 0) return refused(error);
    pipeline_ = gst_parse_launch_full(text.c_str(), nullptr, GST_PARSE_FLAG_FATAL_ERRORS, &error);
    if (pipeline_ == nullptr || error != nullptr) return refused(error);
    // Of its own: a single element is no pipeline.
    gst_object_ref_sink(pipeline_);
    if (auto found = find_sink(); !found) return found;
    GstCaps* caps = gst_caps_from_string(kCaps);
    gst_app_sink_set_caps(sink_, caps);
    gst_caps_unref(caps);
    gst_app_sink_set_max_buffers(sink_, kBuffers);
    gst_app_sink_set_drop(sink_, TRUE);
    gst_element_set_state(pipeline_, GST_STATE_PLAYING);
    // Until it plays or fails; what takes longer (RTSP) goes on meanwhile.
    const bool failed =
        gst_element_get_state(pipeline_, nullptr, nullptr, kStart) == GST_STATE_CHANGE_FAILURE;
    if (auto said = heard(); !said) return said;
    if (failed)
      return Error{ErrorCode::kResource, kName, "does not start", "try it with gst-launch-1.0 -v"};
    return {};
  }

  void close() override {
    release();
    if (pipeline_ != nullptr) gst_element_set_state(pipeline_, GST_STATE_NULL);
    if (sink_ != nullptr) gst_object_unref(std::exchange(sink_, nullptr));
    if (pipeline_ != nullptr) gst_object_unref(std::exchange(pipeline_, nullptr));
    live_.reset();
  }

  Result<std::optional<PipelinePicture>> next(std::chrono::microseconds timeout) override {
    if (sink_ == nullptr) return Error{ErrorCode::kNotAvailable, kName, "is not open", ""};
    GstSample* sample =
        gst_app_sink_try_pull_sample(sink_, static_cast<GstClockTime>(timeout.count()) * 1000);
    if (sample == nullptr) {
      if (auto said = heard(); !said) return said.error();
      return std::optional<PipelinePicture>();
    }
    release();
    sample_ = sample;
    return picture();
  }

 private:
  static Error refused(GError* error) {
    Error out = parse_error(error);
    g_clear_error(&error);
    return out;
  }

  Result<void> find_sink() {
    const Error none{ErrorCode::kConfiguration, kName, "does not end in one appsink",
                     "write: SOURCE ! ... ! videoconvert ! appsink"};
    if (!GST_IS_BIN(pipeline_)) return none;
    int found = 0;
    GstIterator* all = gst_bin_iterate_recurse(GST_BIN(pipeline_));
    GValue item = G_VALUE_INIT;
    while (gst_iterator_next(all, &item) == GST_ITERATOR_OK) {
      if (GST_IS_APP_SINK(g_value_get_object(&item)) && ++found == 1)
        sink_ = GST_APP_SINK(g_value_dup_object(&item));
      g_value_reset(&item);
    }
    g_value_unset(&item);
    gst_iterator_free(all);
    return found == 1 ? Result<void>{} : none;
  }

  /// What the pipeline says: an error, or its end.
  Result<void> heard() {
    GstBus* bus = gst_element_get_bus(pipeline_);
    GstMessage* message =
        gst_bus_pop_filtered(bus, static_cast<GstMessageType>(GST_MESSAGE_ERROR | GST_MESSAGE_EOS));
    gst_object_unref(bus);
    if (message == nullptr) return {};
    Error error{ErrorCode::kNotAvailable, kName, "has come to its end",
                "a camera never ends: was it switched off? A file does: multifilesrc loop=true"};
    if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) error = pipeline_error(message);
    gst_message_unref(message);
    return error;
  }

  Result<std::optional<PipelinePicture>> picture() {
    GstVideoInfo info;
    GstBuffer* buffer = gst_sample_get_buffer(sample_);
    GstCaps* caps = gst_sample_get_caps(sample_);
    if (buffer == nullptr || caps == nullptr || gst_video_info_from_caps(&info, caps) == 0 ||
        !format_of(GST_VIDEO_INFO_FORMAT(&info)))
      return Error{ErrorCode::kResource, kName, "gives what is no picture",
                   "put videoconvert before appsink"};
    if (gst_video_frame_map(&frame_, &info, buffer, GST_MAP_READ) == 0)
      return Error{ErrorCode::kResource, kName, "gives pictures that cannot be read",
                   "put videoconvert before appsink"};
    mapped_ = true;
    PipelinePicture out;
    out.arrival = SystemClock().now();
    if (!live_) live_ = stamps_captures(pipeline_, GST_ELEMENT(sink_));
    if (const auto taken = capture_time(sample_, pipeline_, *live_)) {
      out.captured = taken->epoch;
      out.clock = taken->clock;
    }
    if (GST_BUFFER_OFFSET_IS_VALID(buffer)) out.number = GST_BUFFER_OFFSET(buffer);
    const int stride = GST_VIDEO_FRAME_PLANE_STRIDE(&frame_, 0);
    out.picture.data = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame_, 0));
    out.picture.row_bytes = stride > 0 ? static_cast<std::size_t>(stride) : 0;
    out.picture.width = static_cast<std::uint32_t>(GST_VIDEO_FRAME_WIDTH(&frame_));
    out.picture.height = static_cast<std::uint32_t>(GST_VIDEO_FRAME_HEIGHT(&frame_));
    out.picture.format = *format_of(GST_VIDEO_INFO_FORMAT(&info));
    out.picture.bytes = out.picture.row_bytes * out.picture.height;
    return std::optional(out);
  }

  void release() {
    if (std::exchange(mapped_, false)) gst_video_frame_unmap(&frame_);
    if (sample_ != nullptr) gst_sample_unref(std::exchange(sample_, nullptr));
  }

  GstElement* pipeline_ = nullptr;
  GstAppSink* sink_ = nullptr;
  GstSample* sample_ = nullptr;  ///< the last picture, while it is looked at
  GstVideoFrame frame_{};        ///< of it
  bool mapped_ = false;
  std::optional<bool> live_;  ///< known once pictures come
};

}  // namespace
}  // namespace crane

// GStreamer's types are registered once a process and stay: never unloaded.
extern "C" crane::PipelineIo* cranemap_gstreamer_io() {
  return new crane::GStreamer;
}
