// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/camera_device.hpp"

#include <ctime>
#include <string>
#include <utility>

#include "sensors/camera/folder_device.hpp"
#include "sensors/camera/genicam_device.hpp"
#include "sensors/camera/load_module.hpp"
#include "sensors/camera/paired_device.hpp"
#include "sensors/camera/pipeline_device.hpp"
#include "sensors/camera/v4l2_device.hpp"

namespace crane {
namespace {

using Made = Result<std::unique_ptr<StereoDevice>>;

const SystemClock kNow;
const MonotonicClock kSteady;

/// Both clocks as near to one moment as can be: the wall clock between two looks at the other.
ClockPair both_clocks() {
  const auto monotonic = [] {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * kNsPerSecond + t.tv_nsec;
  };
  const TimeNs before = monotonic();
  const TimeNs epoch = SystemClock().now();
  return {before + (monotonic() - before) / 2, epoch};
}

TimeNs latency(const CameraConfig& config) {
  return config.latency_ms * (kNsPerSecond / 1000);
}

Result<void> check_size(const CameraConfig& config, const std::optional<StereoRig>& rig,
                        std::uint64_t most_pixels) {
  const auto width = static_cast<std::uint32_t>(config.width);
  const auto height = static_cast<std::uint32_t>(config.height);
  const std::string size = std::to_string(width) + " x " + std::to_string(height);
  if (std::uint64_t{width} * height > most_pixels)
    return Error{ErrorCode::kConfiguration, "camera.width",
                 size + " is more than the " + std::to_string(most_pixels) +
                     " pixels that an image may have",
                 "use a smaller mode of the camera"};
  if (rig && (rig->left.width != width || rig->left.height != height || rig->right.width != width ||
              rig->right.height != height))
    return Error{ErrorCode::kConfiguration, "camera.width",
                 size + " is not the size of the calibration, " + std::to_string(rig->left.width) +
                     " x " + std::to_string(rig->left.height),
                 "use the calibration of this camera in this mode"};
  return {};
}

Made make_v4l2(const CameraConfig& config, const std::string& path) {
  V4l2Options o;
  o.path = path;
  o.layout = static_cast<PairLayout>(config.layout);
  o.single = !config.right.empty();
  o.width = static_cast<std::uint32_t>(config.width);
  o.height = static_cast<std::uint32_t>(config.height);
  o.rate_hz = config.rate_hz;
  o.swap = config.swap;
  o.latency = latency(config);
  if (config.exposure_100us > 0) o.exposure = config.exposure_100us;
  if (config.gain >= 0) o.gain = config.gain;
  if (config.brightness > 0) o.brightness = config.brightness;
  return std::unique_ptr<StereoDevice>(
      std::make_unique<V4l2Device>(std::move(o), kernel_v4l2(), both_clocks));
}

Made make_genicam(const CameraConfig& config, const std::string& name) {
  auto io = load_genicam();
  if (!io) return io.error();
  GenicamOptions o;
  o.camera = name;
  o.single = !config.right.empty();
  o.width = static_cast<std::uint32_t>(config.width);
  o.height = static_cast<std::uint32_t>(config.height);
  o.pixel_format = config.pixel_format;
  o.rate_hz = config.rate_hz;
  o.trigger = config.trigger;
  o.stamps = static_cast<GenicamOptions::Stamps>(config.stamps);
  o.ptp = config.ptp;
  if (config.exposure_100us > 0) o.exposure_us = 100.0 * config.exposure_100us;
  if (config.gain >= 0) o.gain = config.gain;
  o.swap = config.swap;
  o.latency = latency(config);
  return std::unique_ptr<StereoDevice>(
      std::make_unique<GenicamDevice>(std::move(o), std::move(*io), both_clocks));
}

Made make_pipeline(const CameraConfig& config) {
  auto io = load_gstreamer();
  if (!io) return io.error();
  PipelineOptions o;
  o.pipeline = config.pipeline;
  o.width = static_cast<std::uint32_t>(config.width);
  o.height = static_cast<std::uint32_t>(config.height);
  o.swap = config.swap;
  o.for_viewing = config.for_viewing;
  o.latency = latency(config);
  return std::unique_ptr<StereoDevice>(
      std::make_unique<PipelineDevice>(std::move(o), std::move(*io)));
}

Made make_one(const CameraConfig& config, const std::string& name) {
  return config.source == CameraConfig::Source::kV4l2 ? make_v4l2(config, name)
                                                      : make_genicam(config, name);
}

}  // namespace

Made make_camera_device(const CameraConfig& config, const std::optional<StereoRig>& rig,
                        std::uint64_t most_pixels) {
  using Source = CameraConfig::Source;
  if (config.source == Source::kRecording) return std::unique_ptr<StereoDevice>();
  if (config.source == Source::kFolder)
    return std::unique_ptr<StereoDevice>(std::make_unique<FolderDevice>(
        FolderOptions{config.path, latency(config), config.remove, rig}, kNow, kSteady));
  if (auto fits = check_size(config, rig, most_pixels); !fits) return fits.error();
  if (config.source == Source::kGstreamer) return make_pipeline(config);
  auto left = make_one(config, config.path);
  if (!left || config.right.empty()) return left;
  auto right = make_one(config, config.right);
  if (!right) return right;
  PairRule rule;
  if (config.pair_by == CameraConfig::PairBy::kNumber) rule.by = PairRule::By::kNumber;
  const double within_ms =
      config.pair_within_ms > 0 ? config.pair_within_ms : 250.0 / config.rate_hz;
  rule.within = static_cast<TimeNs>(within_ms * 1e6);
  const std::size_t pixels = std::size_t(config.width) * std::size_t(config.height);
  return std::unique_ptr<StereoDevice>(std::make_unique<PairedDevice>(
      std::move(*left), std::move(*right), rule, 3 * pixels, pixels));
}

}  // namespace crane
