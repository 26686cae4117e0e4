// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/genicam_settings.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string_view>

#include "sensors/camera/raw_picture.hpp"

namespace crane {
namespace {

std::string number_text(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

class Settings {
 public:
  Settings(GenicamIo& io, const GenicamOptions& options) : io_(io), options_(options) {}
  Result<void> set_mode();
  Result<void> set_trigger();
  Result<void> set_light();
  Result<GenicamClock> set_clock();

 private:
  using Names = std::initializer_list<const char*>;
  const char* first_of(Names names);
  Result<void> set_number(Names names, double value, const char* key, double tolerance);
  Result<void> set_text(const char* feature, const std::string& value, const char* key);
  Error trouble(const Error& error, const char* key);

  GenicamIo& io_;
  const GenicamOptions& options_;
};

const char* Settings::first_of(Names names) {
  for (const char* name : names)
    if (io_.has(name)) return name;
  return nullptr;
}

/// What the camera did not accept is the configuration's matter, unless the camera is gone.
Error Settings::trouble(const Error& error, const char* key) {
  if (io_.lost() || error.code != ErrorCode::kBadData) return error;
  return {ErrorCode::kConfiguration, options_.camera, error.what,
          std::string("change camera.") + key + "; arv-tool-0.8 features shows what it has"};
}

Result<void> Settings::set_number(Names names, double value, const char* key, double tolerance) {
  const char* name = first_of(names);
  if (name == nullptr)
    return Error{ErrorCode::kConfiguration, options_.camera,
                 std::string("has no ") + *names.begin() + " to set",
                 std::string("leave camera.") + key + " out"};
  if (const auto range = io_.range(name);
      range && (value < range->least - tolerance || value > range->most + tolerance))
    return Error{ErrorCode::kConfiguration, options_.camera,
                 std::string(name) + " " + number_text(value) + " is not within its " +
                     number_text(range->least) + " .. " + number_text(range->most),
                 std::string("change camera.") + key};
  if (auto set = io_.set_number(name, value); !set) return trouble(set.error(), key);
  const auto is = io_.number(name);
  if (!is) return trouble(is.error(), key);
  if (std::abs(*is - value) > tolerance)
    return Error{
        ErrorCode::kConfiguration, options_.camera,
        std::string(name) + " was set to " + number_text(value) + " and is " + number_text(*is),
        std::string("change camera.") + key + " to what the camera can"};
  return {};
}

Result<void> Settings::set_text(const char* feature, const std::string& value, const char* key) {
  if (auto set = io_.set_text(feature, value); !set) return trouble(set.error(), key);
  const auto is = io_.text(feature);
  if (!is) return trouble(is.error(), key);
  if (*is != value)
    return Error{ErrorCode::kConfiguration, options_.camera,
                 std::string(feature) + " was set to " + value + " and is " + *is,
                 std::string("change camera.") + key};
  return {};
}

Result<void> Settings::set_mode() {
  // From the middle of a larger sensor nothing is cut: offsets first, or the size does not fit.
  for (const char* offset : {"OffsetX", "OffsetY"})
    if (io_.has(offset)) (void)io_.set_number(offset, 0);
  const std::uint32_t width = options_.single ? options_.width : 2 * options_.width;
  if (auto set = set_number({"Width"}, width, "width", 0); !set) return set;
  if (auto set = set_number({"Height"}, options_.height, "height", 0); !set) return set;
  if (!raw_format_of(options_.pixel_format))
    return Error{ErrorCode::kConfiguration, options_.camera,
                 "nothing is known of PixelFormat " + options_.pixel_format,
                 "set camera.pixel_format to one of " + known_raw_formats()};
  return set_text("PixelFormat", options_.pixel_format, "pixel_format");
}

Result<void> Settings::set_trigger() {
  if (io_.has("AcquisitionMode"))
    if (auto set = set_text("AcquisitionMode", "Continuous", "trigger"); !set) return set;
  if (io_.has("TriggerSelector"))
    if (auto set = set_text("TriggerSelector", "FrameStart", "trigger"); !set) return set;
  if (options_.trigger != "off") {
    const std::string source = options_.trigger == "software" ? "Software" : options_.trigger;
    if (auto set = set_text("TriggerSource", source, "trigger"); !set) return set;
    if (io_.has("TriggerActivation"))
      if (auto set = set_text("TriggerActivation", "RisingEdge", "trigger"); !set) return set;
    return set_text("TriggerMode", "On", "trigger");
  }
  if (io_.has("TriggerMode"))
    if (auto set = set_text("TriggerMode", "Off", "trigger"); !set) return set;
  if (io_.has("AcquisitionFrameRateEnable"))
    if (auto set = io_.set_flag("AcquisitionFrameRateEnable", true); !set)
      return trouble(set.error(), "rate_hz");
  return set_number({"AcquisitionFrameRate", "AcquisitionFrameRateAbs"}, options_.rate_hz,
                    "rate_hz", 0.02 * options_.rate_hz);
}

Result<void> Settings::set_light() {
  if (options_.exposure_us) {
    if (io_.has("ExposureAuto"))
      if (auto set = set_text("ExposureAuto", "Off", "exposure_100us"); !set) return set;
    if (auto set = set_number({"ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw"},
                              *options_.exposure_us, "exposure_100us",
                              std::max(20.0, 0.02 * *options_.exposure_us));
        !set)
      return set;
  }
  if (!options_.gain) return {};
  if (io_.has("GainAuto"))
    if (auto set = set_text("GainAuto", "Off", "gain"); !set) return set;
  return set_number({"Gain", "GainRaw"}, *options_.gain, "gain", 0.5);
}

Result<GenicamClock> Settings::set_clock() {
  GenicamClock clock;
  if (options_.stamps == GenicamOptions::Stamps::kChunk) {
    for (const char* feature : {"ChunkModeActive", "ChunkSelector", "ChunkEnable"})
      if (!io_.has(feature) && feature != std::string_view("ChunkEnable"))
        return Error{ErrorCode::kConfiguration, options_.camera,
                     std::string("has no ") + feature + ": it sends no times in chunks",
                     "set camera.stamps: camera"};
    if (auto set = io_.set_flag("ChunkModeActive", true); !set)
      return trouble(set.error(), "stamps");
    if (auto set = set_text("ChunkSelector", "Timestamp", "stamps"); !set) return set.error();
    if (auto set = io_.set_flag("ChunkEnable", true); !set) return trouble(set.error(), "stamps");
    clock.ticks_per_second = 1e9;
    if (io_.has("GevTimestampTickFrequency"))
      if (const auto ticks = io_.number("GevTimestampTickFrequency"); ticks && *ticks > 0)
        clock.ticks_per_second = *ticks;
  }
  if (!options_.ptp) return clock;
  const char* enable = first_of({"PtpEnable", "GevIEEE1588"});
  clock.ptp_status = first_of({"PtpStatus", "GevIEEE1588Status"});
  if (enable == nullptr || clock.ptp_status == nullptr)
    return Error{ErrorCode::kConfiguration, options_.camera, "does not know PTP (IEEE 1588)",
                 "leave camera.ptp out: its clock is followed without it"};
  if (auto set = io_.set_flag(enable, true); !set) return trouble(set.error(), "ptp");
  return clock;
}

}  // namespace

Result<GenicamClock> set_genicam(GenicamIo& io, const GenicamOptions& options) {
  Settings settings(io, options);
  for (auto step : {&Settings::set_mode, &Settings::set_trigger, &Settings::set_light})
    if (auto done = (settings.*step)(); !done) return done.error();
  return settings.set_clock();
}

}  // namespace crane
