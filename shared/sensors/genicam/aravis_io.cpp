// SPDX-License-Identifier: Apache-2.0
#include "sensors/genicam/aravis_io.hpp"

#include <arv.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <utility>

namespace crane {
namespace {

constexpr int kBuffers = 8;

/// What Aravis says of a call that failed.
class Said {
 public:
  Said() = default;
  Said(const Said&) = delete;
  Said& operator=(const Said&) = delete;
  ~Said() { g_clear_error(&error_); }
  GError** here() { return &error_; }
  [[nodiscard]] bool failed() const { return error_ != nullptr; }
  /// The camera did not answer, and that was asked several times.
  [[nodiscard]] bool timed_out() const {
    return g_error_matches(error_, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_TIMEOUT) != 0;
  }
  [[nodiscard]] std::string text() const { return error_ == nullptr ? "" : error_->message; }

 private:
  GError* error_ = nullptr;
};

class Aravis final : public GenicamIo {
 public:
  ~Aravis() override { Aravis::close(); }

  Result<void> open(const std::string& name) override {
    close();
    name_ = name;
    Said said;
    camera_ = arv_camera_new(name.c_str(), said.here());
    if (camera_ == nullptr)
      return Error{
          ErrorCode::kNotAvailable, name, "no such camera answers: " + said.text(),
          "is it powered, and on a network of this host? arv-tool-0.8 lists what is there"};
    device_ = arv_camera_get_device(camera_);
    if (ARV_IS_GV_DEVICE(device_) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device_)))
      return Error{ErrorCode::kResource, name, "another program controls it", "end that program"};
    lost_ = false;
    g_signal_connect(device_, "control-lost", G_CALLBACK(+[](ArvDevice*, void* lost) {
                       static_cast<std::atomic<bool>*>(lost)->store(true);
                     }),
                     &lost_);
    return {};
  }

  void close() override {
    held_ = nullptr;
    if (started_ && !lost_) arv_camera_stop_acquisition(camera_, nullptr);
    started_ = false;
    // The stream first: its thread writes into buffers and asks the device for packets.
    g_clear_object(&chunks_);
    g_clear_object(&stream_);
    if (device_ != nullptr) g_signal_handlers_disconnect_by_data(device_, &lost_);
    device_ = nullptr;
    g_clear_object(&camera_);
  }

  bool has(const char* feature) override {
    return device_ != nullptr && arv_device_is_feature_available(device_, feature, nullptr) != 0;
  }

  Result<double> number(const char* feature) override {
    Said said;
    const double value =
        is_float(feature)
            ? arv_device_get_float_feature_value(device_, feature, said.here())
            : double(arv_device_get_integer_feature_value(device_, feature, said.here()));
    if (said.failed()) return failed(feature, said);
    return value;
  }
  Result<Range> range(const char* feature) override {
    Said said;
    Range out;
    if (is_float(feature)) {
      arv_device_get_float_feature_bounds(device_, feature, &out.least, &out.most, said.here());
    } else {
      gint64 least = 0;
      gint64 most = 0;
      arv_device_get_integer_feature_bounds(device_, feature, &least, &most, said.here());
      out = {double(least), double(most)};
    }
    if (said.failed()) return failed(feature, said);
    return out;
  }
  Result<void> set_number(const char* feature, double value) override {
    Said said;
    if (is_float(feature))
      arv_device_set_float_feature_value(device_, feature, value, said.here());
    else
      arv_device_set_integer_feature_value(device_, feature, std::llround(value), said.here());
    return done(feature, said);
  }
  Result<std::string> text(const char* feature) override {
    Said said;
    const char* value = arv_device_get_string_feature_value(device_, feature, said.here());
    if (said.failed() || value == nullptr) return failed(feature, said);
    return std::string(value);
  }
  Result<void> set_text(const char* feature, const std::string& value) override {
    Said said;
    arv_device_set_string_feature_value(device_, feature, value.c_str(), said.here());
    return done(feature + (" " + value), said);
  }
  Result<void> set_flag(const char* feature, bool value) override {
    Said said;
    arv_device_set_boolean_feature_value(device_, feature, value ? TRUE : FALSE, said.here());
    return done(feature, said);
  }
  Result<void> command(const char* feature) override {
    Said said;
    arv_device_execute_command(device_, feature, said.here());
    return done(feature, said);
  }

  Result<void> start() override {
    Said said;
    const guint payload = arv_camera_get_payload(camera_, said.here());
    if (said.failed()) return failed("PayloadSize", said);
    if (payload == 0 || payload > kLargestPayload)
      return Error{ErrorCode::kBadData, name_,
                   "says its pictures have " + std::to_string(payload) + " bytes", ""};
    stream_ = arv_camera_create_stream(camera_, nullptr, nullptr, said.here());
    if (stream_ == nullptr)
      return Error{ErrorCode::kResource, name_, "no stream of it can be made: " + said.text(),
                   "does a firewall of this host stop its UDP packets?"};
    for (int n = 0; n < kBuffers; ++n)
      arv_stream_push_buffer(stream_, arv_buffer_new_allocate(payload));
    arv_camera_start_acquisition(camera_, said.here());
    started_ = !said.failed();
    return done("AcquisitionStart", said);
  }

  std::optional<GenicamPicture> next(std::chrono::microseconds timeout) override {
    if (stream_ == nullptr) return std::nullopt;
    ArvBuffer* buffer = timeout.count() <= 0 ? arv_stream_try_pop_buffer(stream_)
                                             : arv_stream_timeout_pop_buffer(
                                                   stream_, static_cast<guint64>(timeout.count()));
    if (buffer == nullptr) return std::nullopt;
    if (held_ != nullptr) arv_stream_push_buffer(stream_, held_);
    held_ = buffer;
    return picture(buffer);
  }

  std::optional<std::int64_t> chunk(const char* feature) override {
    if (held_ == nullptr || arv_buffer_has_chunks(held_) == 0) return std::nullopt;
    if (chunks_ == nullptr) chunks_ = arv_camera_create_chunk_parser(camera_);
    Said said;
    const gint64 value = arv_chunk_parser_get_integer_value(chunks_, held_, feature, said.here());
    if (said.failed()) return std::nullopt;
    return value;
  }

  bool lost() override { return lost_; }

 private:
  static constexpr guint kLargestPayload = 256U << 20U;

  bool is_float(const char* feature) {
    return ARV_IS_GC_FLOAT(arv_device_get_feature(device_, feature)) != 0;
  }
  /// Of a feature: the camera does not take it. It may be gone as well: lost() knows.
  [[nodiscard]] Error failed(const std::string& feature, const Said& said) {
    if (said.timed_out()) lost_ = true;
    return {lost_ ? ErrorCode::kNotAvailable : ErrorCode::kBadData, name_,
            feature + ": " + (said.failed() ? said.text() : "nothing is answered"), ""};
  }
  [[nodiscard]] Result<void> done(const std::string& feature, const Said& said) {
    if (said.failed()) return failed(feature, said);
    return {};
  }

  static GenicamPicture picture(ArvBuffer* buffer) {
    GenicamPicture out;
    out.number = arv_buffer_get_frame_id(buffer);
    out.stamp = static_cast<TimeNs>(arv_buffer_get_timestamp(buffer));
    out.arrival = static_cast<TimeNs>(arv_buffer_get_system_timestamp(buffer));
    switch (arv_buffer_get_status(buffer)) {
      case ARV_BUFFER_STATUS_SUCCESS:
        break;
      case ARV_BUFFER_STATUS_TIMEOUT:
      case ARV_BUFFER_STATUS_MISSING_PACKETS:
      case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
        out.state = GenicamPicture::State::kPacketsLost;
        return out;
      default:
        out.state = GenicamPicture::State::kUnusable;
        return out;
    }
    const ArvBufferPayloadType type = arv_buffer_get_payload_type(buffer);
    if (type != ARV_BUFFER_PAYLOAD_TYPE_IMAGE &&
        type != ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA) {
      out.state = GenicamPicture::State::kUnusable;
      return out;
    }
    std::size_t bytes = 0;
    gint x_padding = 0;
    gint y_padding = 0;
    out.data = static_cast<const std::uint8_t*>(arv_buffer_get_image_data(buffer, &bytes));
    out.bytes = bytes;
    out.width = static_cast<std::uint32_t>(std::max(0, arv_buffer_get_image_width(buffer)));
    out.height = static_cast<std::uint32_t>(std::max(0, arv_buffer_get_image_height(buffer)));
    arv_buffer_get_image_padding(buffer, &x_padding, &y_padding);
    out.padding = static_cast<std::uint32_t>(std::max(0, x_padding));
    out.pixel_format = arv_buffer_get_image_pixel_format(buffer);
    return out;
  }

  std::string name_;
  ArvCamera* camera_ = nullptr;
  ArvDevice* device_ = nullptr;  ///< the camera's
  ArvStream* stream_ = nullptr;
  ArvChunkParser* chunks_ = nullptr;
  ArvBuffer* held_ = nullptr;  ///< the stream's, out of its queues
  bool started_ = false;
  std::atomic<bool> lost_ = false;
};

}  // namespace
}  // namespace crane

// GLib types are registered once a process and stay: never unloaded.
extern "C" crane::GenicamIo* cranemap_genicam_io() {
  return new crane::Aravis;
}
