#include "camera_player.hpp"

#include <cstring>
#include <set>

#include "base/log.hpp"
#include "bounds.h"
#include "geometry/calibration_digest.hpp"
#include "recording/image_file.hpp"
#include "recording/recording.hpp"
#include "service/player.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

/// Frames the camera may be ahead of the map when it is paced by it. Less than the depth of the
/// topics' histories, so that nothing is overwritten.
constexpr std::int64_t kWindow = 3;
constexpr TimeNs kDecodeAhead = kNsPerSecond / 20;  ///< decoding takes 15 to 30 ms

class Player {
 public:
  Player(ServiceContext& context, const PlayOptions& options, Recording recording, PlayRate rate,
         dds::Writer<dds::StereoFrameTopic> writer)
      : context_(context),
        options_(options),
        recording_(std::move(recording)),
        rate_(rate),
        stamp_offset_(stamp_offset(options, rate, recording_.start(), recording_.end())),
        writer_(std::move(writer)),
        calibration_(calibration_digest(recording_.rig())) {}

  Result<void> play() {
    status().expected = options_.loop ? 0 : recording_.frames().size();
    status().stream = options_.stream;
    log_info("plays as soon as stereo_frame has a reader");
    wait_for_reader(writer_, context_);
    Result<void> played = rate_.paced_by_map() ? play_paced() : play_timed();
    if (!played || context_.stopping()) return played;
    wait_until_taken(writer_, context_);
    status().finished = true;
    log_info("end of the recording: " + std::to_string(status().published) + " frames published");
    status().tick(true);
    return {};
  }

 private:
  StatusReporter& status() { return context_.status; }

  /// By the clock; frames wait for nobody.
  Result<void> play_timed() {
    const PlayClock clock = play_clock(options_, rate_, recording_.start());
    const auto count = static_cast<std::int64_t>(recording_.frames().size());
    for (std::int64_t n = 0; (options_.loop || n < count) && !context_.stopping(); ++n) {
      const TimeNs time = recording_.frame_time(n);
      if (options_.resume && clock.due(time) < MonotonicClock().now()) {
        status().dropped.add(Cause::kSkippedAfterRestart);
        continue;
      }
      // Not at once: the stages that work on the frame before need the processor now.
      wait_until(clock.due(time) - kDecodeAhead, context_);
      const Result<bool> ready = load(n);
      if (!ready) return ready.error();
      wait_until(clock.due(time), context_);
      if (context_.stopping()) break;
      if (*ready) send(n, -1);
      status().tick();
    }
    return {};
  }

  /// As fast as the map takes frames. What got lost on the way (a service was restarted) is sent
  /// again: go-back-N, with the sequence numbers of map_status as acknowledgement.
  Result<void> play_paced() {
    Wakeup wakeup;
    auto progress = MapProgress::create(context_.participant, &wakeup, options_.stream);
    if (!progress) return progress.error();
    const auto count = static_cast<std::int64_t>(recording_.frames().size());
    std::int64_t next = 0;
    std::int64_t last_heard = -1;
    std::int64_t accounted = -1;
    int resends = 0;
    Stopwatch since_progress;
    while (!context_.stopping()) {
      const std::int64_t heard = progress->poll().value_or(-1);
      if (heard != last_heard) {
        if (heard < last_heard) next = heard + 1;  // the mapper fell back to its saved state
        last_heard = accounted = heard;
        resends = 0;
        since_progress = {};
      }
      while (unreadable_.contains(accounted + 1)) ++accounted;
      next = std::max(next, accounted + 1);
      if (accounted >= count - 1) return {};
      if (next < count && next <= accounted + kWindow) {
        const Result<bool> ready = load(next);
        if (!ready) return ready.error();
        if (*ready) send(next, before(next));
        ++next;
        continue;
      }
      if (since_progress.ms() > double(kResendAfter.count())) {
        if (++resends > kMaxResends)
          return Error{
              ErrorCode::kResource, "stereo_frame",
              "no map has accounted for frame " + std::to_string(accounted + 1) +
                  " although it was sent " + std::to_string(resends) + " times",
              "are cranemap-stereo and cranemap-mapper running for this crane and domain?"};
        next = accounted + 1;
        status().dropped.add(Cause::kSentAgain);
        since_progress = {};
      }
      status().tick();
      wakeup.wait_for(20ms);
    }
    return {};
  }

  /// Decodes frame n into left_ and right_. False: unreadable, counted and skipped.
  /// Error: Configuration.
  Result<bool> load(std::int64_t n) {
    const RecordedFrame& frame = recording_.frame(n);
    const Stopwatch watch;
    for (bool is_left : {true, false}) {
      const CameraModel& model = is_left ? recording_.rig().left : recording_.rig().right;
      auto image =
          read_image(is_left ? frame.left_file : frame.right_file, v1::MAX_PIXELS, model.bits);
      if (image && (image->width != model.width || image->height != model.height))
        image = Error{ErrorCode::kWrongSize, is_left ? frame.left_file : frame.right_file,
                      std::to_string(image->width) + " x " + std::to_string(image->height) +
                          " pixels, sensor.yaml says " + std::to_string(model.width) + " x " +
                          std::to_string(model.height),
                      "use the calibration of this camera at this resolution"};
      // Of no image of this camera could be made more: sensor.yaml must say it.
      if (!image && image.error().code == ErrorCode::kConfiguration) return image.error();
      if (!image) {
        log_error(image.error().text());
        if (unreadable_.insert(n).second) status().dropped.add(Cause::kImageUnreadable);
        status().status = v1::STATUS_DEGRADED;
        status().message = image.error().text();
        return false;
      }
      (is_left ? left_ : right_) = std::move(*image);
    }
    if (left_.channels != right_.channels) {
      log_error(frame.left_file + ": left and right differ in colour");
      if (unreadable_.insert(n).second) status().dropped.add(Cause::kColourDiffers);
      return false;
    }
    status().stages.add("decode", watch.ms());
    ++status().received;
    return true;
  }

  /// The readable frame before frame n; -1 = none.
  [[nodiscard]] std::int64_t before(std::int64_t n) const {
    do --n;
    while (unreadable_.contains(n));
    return n;
  }

  void send(std::int64_t n, std::int64_t after) {
    const Stopwatch watch;
    v1::StereoFrame* sample = writer_.loan();
    if (sample == nullptr) {
      status().dropped.add(Cause::kNoFrameMemory);
      return;
    }
    sample->crane(context_.participant->settings().crane);
    sample->encoding(left_.channels == 3 ? v1::ENCODING_BGR8 : v1::ENCODING_MONO8);
    sample->stream(options_.stream);
    sample->sequence_number(static_cast<std::uint64_t>(n));
    sample->after(after);
    sample->exposure_time_ns(recording_.frame_time(n) + stamp_offset_);
    sample->calibration(calibration_);
    sample->width(left_.width);
    sample->height(left_.height);
    std::memcpy(sample->left().data(), left_.bytes.data(), left_.bytes.size());
    std::memcpy(sample->right().data(), right_.bytes.data(), right_.bytes.size());
    status().stages.add("fill", watch.ms());
    if (auto sent = writer_.publish(sample); !sent) {
      status().dropped.add(Cause::kNotAcceptedByDds);
      log_warning(sent.error().text());
      return;
    }
    ++status().published;
  }

  ServiceContext& context_;
  const PlayOptions& options_;
  Recording recording_;
  PlayRate rate_;
  TimeNs stamp_offset_;
  dds::Writer<dds::StereoFrameTopic> writer_;
  std::uint64_t calibration_;  ///< digest
  Image left_, right_;
  std::set<std::int64_t> unreadable_;  ///< frames that will never be published
};

}  // namespace

int run_camera(int argc, char** argv) {
  PlayOptions options;
  const ServiceInfo info{"cranemap-camera",
                         "Plays the images of a recording as topic stereo_frame.\n"
                         "Example: cranemap-camera RECORDING --rate 2 --loop",
                         v1::SERVICE_CAMERA};
  return run_service(
      argc, argv, info, [&](CLI::App& app) { add_play_options(app, options); },
      [&](ServiceContext& context) -> Result<void> {
        auto recording = Recording::open(options.recording);
        if (!recording) return recording.error();
        auto rate = check_play_options(options);
        if (!rate) return rate.error();
        auto writer = dds::Writer<dds::StereoFrameTopic>::create(context.participant);
        if (!writer) return writer.error();
        return Player(context, options, std::move(*recording), *rate, std::move(*writer)).play();
      });
}

}  // namespace crane
