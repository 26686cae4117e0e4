// SPDX-License-Identifier: Apache-2.0
#include "stereo_service.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>

#include "base/log.hpp"
#include "bounds.h"
#include "geometry/calibration_digest.hpp"
#include "recording/calibration.hpp"
#include "service/run_service.hpp"
#include "service/stream_gate.hpp"
#include "stereo/stereo_stage.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

/// Share of the pixels with their best match at the near end of the search.
constexpr double kNearLimit = 0.002;

std::string two_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

StereoSettings to_settings(const StereoConfig& c) {
  StereoSettings s;
  switch (c.matcher) {
    case StereoConfig::Matcher::kSgm:
      s.matcher = StereoSettings::Matcher::kSgm;
      break;
    case StereoConfig::Matcher::kBlock:
      s.matcher = StereoSettings::Matcher::kBlock;
      break;
    case StereoConfig::Matcher::kSgbm:
      s.matcher = StereoSettings::Matcher::kSgbm;
      break;
  }
  s.paper = c.paper;
  s.block_px = c.block_px;
  s.speckle_window_px = c.speckle_window_px;
  s.uniqueness_percent = c.uniqueness_percent;
  s.left_right_px = c.left_right_px;
  s.nearest_m = c.nearest_m;
  s.farthest_m = c.farthest_m;
  s.threads = c.threads;
  return s;
}

Cause cause_of(PairFlaw flaw) {
  const auto number =
      static_cast<std::uint32_t>(Cause::kLeftBlack) + static_cast<std::uint32_t>(flaw);
  return crane::cause_of(number).value_or(Cause::kPairTellsNothing);
}

class Service {
 public:
  Service(ServiceContext& context, StereoStage stage, dds::Writer<dds::PartialCloudTopic> clouds,
          std::uint64_t calibration)
      : context_(context),
        stage_(std::move(stage)),
        clouds_(std::move(clouds)),
        calibration_(calibration) {}

  Result<void> run() {
    Wakeup wakeup;
    auto frames = dds::Reader<dds::StereoFrameTopic>::create(context_.participant, &wakeup);
    if (!frames) return frames.error();
    while (!context_.stopping()) {
      wakeup.wait_for(50ms);
      while (!context_.stopping()) {
        auto frame = frames->take();
        if (!frame) break;
        add_delivery_times(status().stages, "camera to stereo", *frame, frames->counts());
        work(std::move(frame), *frames);
      }
      add_reader_drops(status().dropped, Cause::kFrameInvalid, Cause::kFrameLost, frames->counts());
      status().tick();
    }
    return {};
  }

 private:
  StatusReporter& status() { return context_.status; }

  void work(std::unique_ptr<dds::Received<dds::StereoFrame>> received,
            const dds::Reader<dds::StereoFrameTopic>& frames) {
    ++status().received;
    if (!gate_.pass((*received)->stream(), received->writer(), gone_from(frames)))
      return refuse(Cause::kSecondCamera,
                    "frames of two cameras arrive: stop one, or give it another crane number");
    track(**received);
    if (const std::uint64_t theirs = (*received)->calibration(); theirs == kCalibrationForViewing)
      return refuse(Cause::kNoCaptureTime,
                    "the camera's pictures are for viewing only (camera.for_viewing): nobody says "
                    "when they were taken");
    else if (theirs != 0 && theirs != calibration_)
      return refuse(Cause::kFrameOtherCalibration,
                    "frames were taken with another calibration than --calibration: give both the "
                    "same folder");
    const Stopwatch watch;
    const Header header = header_of(*received);
    const auto view = [&f = **received, format = *pixel_format(header.encoding)](
                          const dds::Items<std::uint8_t>& bytes) {
      return ImageView{format, f.width(), f.height(), {bytes.data(), bytes.size()}};
    };
    const auto rectified = stage_.rectify({view((*received)->left()), view((*received)->right()),
                                           static_cast<std::int64_t>(header.sequence_number)});
    const bool intact = received->intact();
    received.reset();  // the camera's memory is not looked at any more
    if (!intact)
      return refuse(Cause::kFrameOverwritten, "this host is too slow for the camera's rate");
    if (!rectified)
      return refuse(rectified.error().code == ErrorCode::kBadData ? Cause::kImageUnreadable
                                                                  : Cause::kFrameMisfit,
                    rectified.error().text());
    dds::PartialCloud* cloud = clouds_.loan();
    if (cloud == nullptr)
      return refuse(Cause::kNoCloudMemory, "a reader of partial_cloud is stuck");
    const std::size_t pixels = std::size_t(stage_.camera().width) * stage_.camera().height;
    const auto report = stage_.match({{cloud->depth().data(), pixels},
                                      {cloud->confidence().data(), pixels},
                                      {cloud->colour().data(), 3 * pixels}});
    if (!report) {
      clouds_.discard(cloud);
      return refuse(Cause::kFrameUnmatched, report.error().text());
    }
    note(*report);
    fill(header, *report, *cloud);
    status().stages.add("rectify", *rectified);
    status().stages.add("match", report->match_ms);
    status().stages.add("depth", report->depth_ms);
    status().stages.add("partial cloud", watch.ms());
    if (auto sent = clouds_.publish(cloud); !sent)
      return refuse(Cause::kNotAcceptedByDds, sent.error().text());
    ++status().published;
  }

  /// Counts what never arrived: numbers of one stream have no gaps at the source.
  void track(const dds::StereoFrame& frame) {
    if (frame.stream() != status().stream) {
      status().stream = frame.stream();
    } else if (frame.sequence_number() > last_ + 1) {
      status().dropped.add(Cause::kFrameMissing, frame.sequence_number() - last_ - 1);
      missing_ += frame.sequence_number() - last_ - 1;
    }
    last_ = frame.sequence_number();
  }

  void refuse(Cause cause, const std::string& text) {
    status().dropped.add(cause);
    status().status = v1::STATUS_DEGRADED;
    if (status().message != text) log_warning(text);
    status().message = text;
  }

  /// Health of the pair. A pair that tells nothing still makes a cloud, without a single match: the
  /// mapper accounts for its frame and leaves the map as it is.
  void note(const StereoReport& report) {
    if (report.flaw) return refuse(cause_of(*report.flaw), advice(*report.flaw));
    if (report.row_error_px && std::abs(*report.row_error_px) > kRowErrorLimit_px) {
      char text[160];
      std::snprintf(text, sizeof text,
                    "rows of the rectified images are %.1f px apart: calibrate the cameras again",
                    *report.row_error_px);
      status().status = v1::STATUS_DEGRADED;
      if (!badly_rectified_) log_warning(text);
      badly_rectified_ = true;
      status().message = text;
      return;
    }
    badly_rectified_ = false;
    if (report.ambiguous > 0) status().dropped.add(Cause::kAmbiguous, report.ambiguous);
    // Pixels whose best match is at the near end of the search may show something nearer.
    const double near =
        double(report.too_near) / (double(stage_.camera().width) * stage_.camera().height);
    if (near > kNearLimit) {
      status().dropped.add(Cause::kTooNear);
      status().status = v1::STATUS_DEGRADED;
      status().message = "something is nearer to the camera than any search: it stays unknown";
      return;
    }
    status().status = v1::STATUS_OK;
    std::string text;
    if (report.row_error_px) text = "epipolar error " + two_digits(*report.row_error_px) + " px";
    if (report.near > 0)
      text += (text.empty() ? "" : "; ") + std::to_string(report.near) +
              " px nearer than stereo.nearest_m, matched at a quarter of the resolution";
    if (report.ambiguous > 0)
      text += (text.empty() ? "" : "; ") + std::to_string(report.ambiguous) +
              " px on patterns that repeat along the rows: no match, they stay unknown";
    status().message = text;
  }

  /// What a cloud takes over from its frame.
  struct Header {
    std::uint32_t crane = 0, encoding = 0;
    std::uint64_t stream = 0, sequence_number = 0;
    std::int64_t after = -1;
    TimeNs exposure_time = 0, sent = 0;
  };
  static Header header_of(const dds::Received<dds::StereoFrame>& frame) {
    const dds::StereoFrame& f = *frame;
    return {f.crane(),
            f.encoding(),
            f.stream(),
            f.sequence_number(),
            f.after(),
            f.exposure_time_ns(),
            frame.source_time_ns()};
  }

  void fill(const Header& header, const StereoReport& report, dds::PartialCloud& cloud) {
    const RectifiedCamera& camera = stage_.camera();
    cloud.crane(header.crane);
    cloud.has_colour(1);  // of a grey camera its grey: the mapper knows places by their look
    cloud.stream(header.stream);
    cloud.sequence_number(header.sequence_number);
    cloud.after(header.after);
    cloud.exposure_time_ns(header.exposure_time);
    cloud.frame_sent_ns(header.sent);
    cloud.calibration(calibration_);
    cloud.f_px(camera.f_px);
    cloud.cx_px(camera.cx_px);
    cloud.cy_px(camera.cy_px);
    cloud.baseline_m(camera.baseline_m);
    cloud.sigma_disparity_px(context_.config.stereo.sigma_disparity_px);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        cloud.rotation()[static_cast<std::size_t>(3 * r + c)] = camera.R_camera_rectified(r, c);
    cloud.width(camera.width);
    cloud.height(camera.height);
    cloud.matched_pixels(report.matched);
    cloud.row_patches(report.rows.patches);
    cloud.row_offset_px(report.rows.offset_px);
    cloud.row_offset_sigma_px(report.rows.offset_sigma_px);
    cloud.row_roll_rad(report.rows.roll_rad);
    cloud.row_roll_sigma_rad(report.rows.roll_sigma_rad);
    cloud.row_slope(report.rows.slope);
    cloud.row_slope_sigma(report.rows.slope_sigma);
    cloud.camera_dropped(static_cast<std::uint32_t>(missing_));
  }

  ServiceContext& context_;
  StereoStage stage_;
  dds::Writer<dds::PartialCloudTopic> clouds_;
  std::uint64_t calibration_;  ///< digest
  StreamGate gate_;
  std::uint64_t last_ = 0, missing_ = 0;
  bool badly_rectified_ = false;
};

}  // namespace

int run_stereo(int argc, char** argv) {
  std::string calibration;
  const ServiceInfo info{"cranemap-stereo",
                         "Stereo frames to organised clouds: topic stereo_frame in, partial_cloud "
                         "out.\nExample: cranemap-stereo --calibration RECORDING",
                         v1::SERVICE_STEREO};
  return run_service(
      argc, argv, info,
      [&](CLI::App& app) {
        app.add_option("--calibration", calibration,
                       "Folder with cam0/sensor.yaml, cam1/sensor.yaml and rig.yaml")
            ->required();
      },
      [&](ServiceContext& context) -> Result<void> {
        auto rig = read_rig(calibration);
        if (!rig) return rig.error();
        if (std::uint64_t(rig->left.width) * rig->left.height > v1::MAX_PIXELS)
          return Error{ErrorCode::kConfiguration, calibration,
                       "images of " + std::to_string(rig->left.width) + " x " +
                           std::to_string(rig->left.height) + " do not fit a stereo frame",
                       "set the camera to 2448 x 2048 or less"};
        use_threads(context.config.stereo.threads);
        auto stage = StereoStage::create(*rig, to_settings(context.config.stereo));
        if (!stage) return stage.error();
        char text[160];
        const double fb = stage->camera().f_px * stage->camera().baseline_m;
        const int first = stage->first_disparity_px();
        const int last = first + stage->disparities_px() - 1;
        std::snprintf(text, sizeof text, "searching %d..%d px: depths %.2f..%.2f m", first, last,
                      fb / last, first > 0 ? fb / first : 1e3);
        log_info(text);
        auto clouds = dds::Writer<dds::PartialCloudTopic>::create(
            context.participant, dds::PartialCloudTopic::kName, 0,
            std::size_t(rig->left.width) * rig->left.height);
        if (!clouds) return clouds.error();
        return Service(context, std::move(*stage), std::move(*clouds), calibration_digest(*rig))
            .run();
      });
}

}  // namespace crane
