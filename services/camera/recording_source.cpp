// SPDX-License-Identifier: Apache-2.0
#include "recording_source.hpp"

#include <algorithm>
#include <cstring>
#include <thread>
#include <utility>

#include "base/log.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

/// Frames the camera may be ahead of the map when it is paced by it. Less than the depth of the
/// topics' histories, so that nothing is overwritten.
constexpr std::int64_t kWindow = 3;
constexpr TimeNs kDecodeAhead = kNsPerSecond / 20;  ///< decoding takes 15 to 30 ms

/// Sleeps until a time of MonotonicClock, but not beyond the deadline. True: it has come.
bool comes_before(TimeNs due, FrameSource::Deadline deadline) {
  const TimeNs left = due - MonotonicClock().now();
  if (left <= 0) return true;
  const auto at = std::chrono::steady_clock::now() + std::chrono::nanoseconds(left);
  std::this_thread::sleep_until(std::min(at, deadline));
  return at <= deadline;
}

}  // namespace

RecordingSource::RecordingSource(const PlayOptions& options, Recording recording, PlayRate rate,
                                 std::optional<MapProgress> progress,
                                 std::unique_ptr<Wakeup> wakeup)
    : options_(options),
      recording_(std::move(recording)),
      rate_(rate),
      stamp_offset_(stamp_offset(options, rate, recording_.start(), recording_.end())),
      progress_(std::move(progress)),
      wakeup_(std::move(wakeup)) {
  // Whether they have colour only an image knows; of one that cannot be read the most is taken.
  const auto first =
      read_image(recording_.frame(0).left_file, kMaxImagePixels, recording_.rig().left.bits);
  const CameraModel& camera = recording_.rig().left;
  image_bytes_ = first ? first->bytes.size() : std::size_t{3} * camera.width * camera.height;
}

Result<FrameSource::Next> RecordingSource::next(const FrameBuffers& out, FrameFacts& facts,
                                                Deadline deadline) {
  return rate_.paced_by_map() ? next_for_map(out, facts) : next_by_clock(out, facts, deadline);
}

/// By the clock; frames wait for nobody.
Result<FrameSource::Next> RecordingSource::next_by_clock(const FrameBuffers& out, FrameFacts& facts,
                                                         Deadline deadline) {
  const auto count = static_cast<std::int64_t>(recording_.frames().size());
  if (!clock_) clock_ = play_clock(options_, rate_, recording_.start());
  if (!options_.loop && next_ >= count) return Next::kEnd;
  const TimeNs due = clock_->due(recording_.frame_time(next_));
  if (!loaded_) {
    if (options_.resume && due < MonotonicClock().now()) {
      dropped_.add(Cause::kSkippedAfterRestart);
      ++next_;
      return Next::kNothing;
    }
    // Not at once: the stages that work on the frame before need the processor now.
    if (!comes_before(due - kDecodeAhead, deadline)) return Next::kNothing;
    const Result<bool> ready = load(next_, out.pixels);
    if (!ready) return ready.error();
    loaded_ = *ready;
    if (!loaded_) ++next_;
    return Next::kNothing;
  }
  if (!fits(out) || !comes_before(due, deadline)) return Next::kNothing;
  fill(next_++, -1, out, facts);
  return Next::kFrame;
}

/// As fast as the map takes frames. What got lost on the way (a service was restarted) is sent
/// again: go-back-N, with the sequence numbers of map_status as acknowledgement.
Result<FrameSource::Next> RecordingSource::next_for_map(const FrameBuffers& out,
                                                        FrameFacts& facts) {
  const auto count = static_cast<std::int64_t>(recording_.frames().size());
  const std::int64_t heard = progress_->poll().value_or(-1);
  if (heard != last_heard_) {
    if (heard < last_heard_) next_ = heard + 1;  // the mapper fell back to its saved state
    last_heard_ = accounted_ = heard;
    resends_ = 0;
    since_progress_ = {};
  }
  while (unreadable_.contains(accounted_ + 1)) ++accounted_;
  next_ = std::max(next_, accounted_ + 1);
  if (accounted_ >= count - 1) return Next::kEnd;
  if (next_ < count && next_ <= accounted_ + kWindow) {
    const std::int64_t n = next_++;
    const Result<bool> ready = load(n, out.pixels);
    if (!ready) return ready.error();
    if (!*ready) return Next::kNothing;
    if (!fits(out)) {
      --next_;
      return Next::kNothing;
    }
    fill(n, before(n), out, facts);
    return Next::kFrame;
  }
  if (since_progress_.ms() > double(kResendAfter.count())) {
    if (++resends_ > kMaxResends)
      return Error{ErrorCode::kResource, "stereo_frame",
                   "no map has accounted for frame " + std::to_string(accounted_ + 1) +
                       " although it was sent " + std::to_string(resends_) + " times",
                   "are cranemap-stereo and cranemap-mapper running for this crane and domain?"};
    next_ = accounted_ + 1;
    dropped_.add(Cause::kSentAgain);
    since_progress_ = {};
  }
  wakeup_->wait_for(20ms);
  return Next::kNothing;
}

/// Decodes frame n into left_ and right_. False: unreadable, counted and skipped.
/// Error: Configuration.
Result<bool> RecordingSource::load(std::int64_t n, std::size_t pixels) {
  const RecordedFrame& frame = recording_.frame(n);
  const Stopwatch watch;
  for (bool is_left : {true, false}) {
    const CameraModel& model = is_left ? recording_.rig().left : recording_.rig().right;
    auto image = read_image(is_left ? frame.left_file : frame.right_file, pixels, model.bits);
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
      if (unreadable_.insert(n).second) dropped_.add(Cause::kImageUnreadable);
      trouble_ = image.error().text();
      return false;
    }
    (is_left ? left_ : right_) = std::move(*image);
  }
  if (left_.channels != right_.channels) {
    log_error(frame.left_file + ": left and right differ in colour");
    if (unreadable_.insert(n).second) dropped_.add(Cause::kColourDiffers);
    return false;
  }
  decode_ms_ = watch.ms();
  ++received_;
  return true;
}

/// The readable frame before frame n; -1 = none.
std::int64_t RecordingSource::before(std::int64_t n) const {
  do --n;
  while (unreadable_.contains(n));
  return n;
}

/// What is loaded; if not, larger buffers come.
bool RecordingSource::fits(const FrameBuffers& out) {
  image_bytes_ = std::max(image_bytes_, left_.bytes.size());
  return left_.bytes.size() <= out.bytes;
}

void RecordingSource::fill(std::int64_t n, std::int64_t after, const FrameBuffers& out,
                           FrameFacts& facts) {
  const Stopwatch watch;
  loaded_ = false;
  facts.width = left_.width;
  facts.height = left_.height;
  facts.format = format_of_channels(left_.channels);
  facts.exposure_time = recording_.frame_time(n) + stamp_offset_;
  facts.stream = options_.stream;
  facts.sequence = n;
  facts.after = after;
  facts.decode_ms = decode_ms_;
  std::memcpy(out.left, left_.bytes.data(), left_.bytes.size());
  std::memcpy(out.right, right_.bytes.data(), right_.bytes.size());
  facts.fill_ms = watch.ms();
}

}  // namespace crane
