// SPDX-License-Identifier: Apache-2.0
#include "camera_service.hpp"

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <random>
#include <thread>

#include "base/log.hpp"
#include "bounds.h"
#include "frame_port.hpp"
#include "geometry/calibration_digest.hpp"
#include "recording/calibration.hpp"
#include "recording_source.hpp"
#include "sensors/camera/camera_device.hpp"
#include "sensors/camera/live_source.hpp"
#include "service/player.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

/// So long a source may wait: status and stop come in between.
constexpr auto kPatience = 50ms;

struct Options {
  PlayOptions play;
  std::string calibration;
};

/// A source and what the service has to know of it.
struct Opened {
  std::unique_ptr<FrameSource> source;
  bool live = true;               ///< waits for nobody and never ends
  std::uint64_t expected = 0;     ///< frames; 0: without end
  std::uint64_t calibration = 0;  ///< digest; 0: not said
};

Result<Opened> open_recording(const PlayOptions& asked, ServiceContext& context) {
  PlayOptions options = asked;
  auto recording = Recording::open(options.recording);
  if (!recording) return recording.error();
  const auto rate = check_play_options(options);
  if (!rate) return rate.error();
  auto wakeup = std::make_unique<Wakeup>();
  std::optional<MapProgress> progress;
  if (rate->paced_by_map()) {
    auto made = MapProgress::create(context.participant, wakeup.get(), options.stream);
    if (!made) return made.error();
    progress.emplace(std::move(*made));
  }
  context.status.stream = options.stream;
  const std::uint64_t calibration = calibration_digest(recording->rig());
  auto source = std::make_unique<RecordingSource>(options, std::move(*recording), *rate,
                                                  std::move(progress), std::move(wakeup));
  const std::uint64_t expected = source->expected();
  return Opened{std::move(source), false, expected, calibration};
}

const MonotonicClock kSteady;

Result<Opened> open_live(const Options& options, const CameraConfig& config) {
  Opened out;
  std::optional<StereoRig> rig;
  if (!options.calibration.empty()) {
    auto read = read_rig(options.calibration);
    if (!read) return read.error();
    out.calibration = calibration_digest(*read);
    rig = *read;
  } else {
    log_warning(
        "without --calibration frames do not say which one they belong to: a wrong one at "
        "cranemap-stereo is then not found out");
  }
  auto device = make_camera_device(config, rig, kMaxImagePixels);
  if (!device) return device.error();
  const auto sleep_until = [](TimeNs time) {
    std::this_thread::sleep_for(std::chrono::nanoseconds(time - kSteady.now()));
  };
  if (config.for_viewing) {
    out.calibration = kCalibrationForViewing;
    log_warning("camera.for_viewing: pictures are published to be looked at, none is mapped");
  }
  out.source = std::make_unique<LiveSource>(std::move(*device), kSteady, sleep_until, [] {
    return (std::uint64_t{std::random_device{}()} << 32U) | std::random_device{}() | 1U;
  });
  return out;
}

Result<Opened> open_source(const Options& options, ServiceContext& context) {
  const CameraConfig& config = context.config.camera;
  if (!options.play.recording.empty()) {
    if (config.source != CameraConfig::Source::kRecording)
      log_info("plays the recording that the command line names, not camera.source");
    return open_recording(options.play, context);
  }
  if (config.source == CameraConfig::Source::kRecording)
    return Error{ErrorCode::kConfiguration, "RECORDING",
                 "is not given, and camera.source names no camera",
                 "name a recording's folder, or set camera.source in --config FILE"};
  return open_live(options, config);
}

/// One loop, the same for every source: loan, next, publish.
class Camera {
 public:
  Camera(ServiceContext& context, Opened opened)
      : context_(context), opened_(std::move(opened)), port_(context.participant) {}
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  Result<void> run() {
    status().expected = opened_.expected;
    if (auto made = port_.grow_to(opened_.source->image_bytes()); !made) return made.error();
    if (!opened_.live) {
      log_info("plays as soon as stereo_frame has a reader");
      wait_for_reader(port_, context_);
    }
    while (!context_.stopping()) {
      const Result<bool> goes_on = turn();
      if (!goes_on) return goes_on.error();
      if (!*goes_on) return finish();
    }
    return {};
  }

 private:
  StatusReporter& status() { return context_.status; }

  /// False at the end.
  Result<bool> turn() {
    const auto buffers = port_.buffers();
    if (!buffers) {  // readers hold all of it
      if (!std::exchange(starved_, true)) status().dropped.add(Cause::kNoFrameMemory);
      status().tick();
      std::this_thread::sleep_for(5ms);
      return true;
    }
    starved_ = false;
    FrameFacts facts;
    const auto next =
        opened_.source->next(*buffers, facts, std::chrono::steady_clock::now() + kPatience);
    if (!next) return next.error();
    if (*next == FrameSource::Next::kFrame) publish(facts);
    if (auto made = port_.grow_to(opened_.source->image_bytes()); !made) return made.error();
    report();
    return *next != FrameSource::Next::kEnd;
  }

  void publish(const FrameFacts& facts) {
    if (opened_.live && status().stream != facts.stream)
      log_info("camera: connected; " + opened_.source->about());
    status().stream = facts.stream;
    status().stages.add("decode", facts.decode_ms);
    status().stages.add("fill", facts.fill_ms);
    if (opened_.live) status().stages.add("arrival jitter", facts.late_ms);
    if (opened_.live)
      status().stages.add("exposure to published",
                          double(SystemClock().now() - facts.exposure_time) * 1e-6);
    if (auto sent = port_.publish(facts, opened_.calibration); !sent) {
      status().dropped.add(Cause::kNotAcceptedByDds);
      log_warning(sent.error().text());
      return;
    }
    ++status().published;
  }

  void report() {
    const FrameSource& source = *opened_.source;
    status().dropped.merge(source.dropped());
    status().received = source.received();
    if (source.trouble() != said_) {
      said_ = source.trouble();
      if (opened_.live) said_.empty() ? log_info("camera: all is well") : log_warning(said_);
      status().status = said_.empty() ? v1::STATUS_OK : v1::STATUS_DEGRADED;
      status().message = said_;
    }
    status().tick();
  }

  Result<void> finish() {
    wait_until_taken(port_, context_);
    status().finished = true;
    log_info("end of the recording: " + std::to_string(status().published) + " frames published");
    status().tick(true);
    return {};
  }

  ServiceContext& context_;
  Opened opened_;
  FramePort port_;
  bool starved_ = false;  ///< there was none the last time
  std::string said_;
};

}  // namespace

int run_camera(int argc, char** argv) {
  Options options;
  const ServiceInfo info{
      "cranemap-camera",
      "Gives pairs of images as topic stereo_frame: of the camera that camera.source of the\n"
      "configuration names, or of a recording.\n"
      "Examples: cranemap-camera --config site.yaml --calibration DIR\n"
      "          cranemap-camera RECORDING --rate 2 --loop",
      v1::SERVICE_CAMERA};
  return run_service(
      argc, argv, info,
      [&](CLI::App& app) {
        add_play_options(app, options.play);
        app.get_option("RECORDING")->required(false);
        app.add_option(
            "--calibration", options.calibration,
            "Of a live camera: folder with cam0/sensor.yaml, cam1/sensor.yaml, rig.yaml");
      },
      [&](ServiceContext& context) -> Result<void> {
        auto opened = open_source(options, context);
        if (!opened) return opened.error();
        return Camera(context, std::move(*opened)).run();
      });
}

}  // namespace crane
