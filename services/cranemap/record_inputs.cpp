// SPDX-License-Identifier: Apache-2.0
#include "record_inputs.hpp"

#include <cmath>
#include <limits>

#include "base/log.hpp"
#include "bounds.h"
#include "dds/hoist_reading.hpp"
#include "geometry/calibration_digest.hpp"
#include "service/status_reporter.hpp"

namespace crane {
namespace {

/// A recording's clock makes no larger step: it would be refused when it is opened.
constexpr TimeNs kLongestStep = 3600 * kNsPerSecond;

bool follows(TimeNs time, TimeNs last) {
  return time > 0 && (last == 0 || (time > last && time - last < kLongestStep));
}

/// A copy of an image as it is; of JPEG all bytes, as only its decoder knows where it ends.
std::vector<std::uint8_t> image_of(const dds::StereoFrame& frame, PixelFormat format,
                                   const dds::Items<std::uint8_t>& bytes) {
  const std::size_t size =
      image_bytes(format, frame.width(), frame.height()).value_or(bytes.size());
  return {bytes.data(), bytes.data() + std::min<std::size_t>(size, bytes.size())};
}

std::string whose(const dds::ReaderCounts& counts, const char* topic, const char* service,
                  const char* device) {
  if (counts.invalid > 0)
    return std::string(topic) + ": " + std::to_string(counts.invalid) +
           " samples broke their contract -> are sender and recorder of one version?";
  if (counts.matched == 0)
    return std::string(topic) + ": nobody publishes it -> does " + service +
           " run, in this domain, for this crane, on this network? 'cranemap doctor' looks further";
  return std::string(topic) + ": " + service + " is there and says nothing -> " + device;
}

}  // namespace

RecordInputs::RecordInputs(dds::Reader<dds::StereoFrameTopic> frames,
                           dds::Reader<dds::RangefinderPositionTopic> positions,
                           dds::Reader<dds::HoistStateTopic> hoist, const StereoRig& rig)
    : frames_(std::move(frames)),
      positions_(std::move(positions)),
      hoist_(std::move(hoist)),
      rig_(rig),
      calibration_(calibration_digest(rig)) {}

Result<RecordInputs> RecordInputs::create(const std::shared_ptr<dds::Participant>& participant,
                                          Wakeup* wakeup, const StereoRig& rig) {
  auto positions = dds::Reader<dds::RangefinderPositionTopic>::create(participant, wakeup);
  if (!positions) return positions.error();
  auto hoist = dds::Reader<dds::HoistStateTopic>::create(participant, wakeup);
  if (!hoist) return hoist.error();
  auto frames = dds::Reader<dds::StereoFrameTopic>::create(participant, wakeup);
  if (!frames) return frames.error();
  return RecordInputs(std::move(*frames), std::move(*positions), std::move(*hoist), rig);
}

Result<void> RecordInputs::take(Recorder& recorder) {
  // Positions first: a frame that came with them is placed by them.
  take_positions(recorder);
  take_hoist(recorder);
  auto taken = take_frames(recorder);
  add_reader_drops(dropped_, Cause::kFrameInvalid, Cause::kFrameLost, frames_.counts());
  add_reader_drops(dropped_, Cause::kPositionInvalid, Cause::kPositionLost, positions_.counts());
  add_reader_drops(dropped_, Cause::kHoistInvalid, Cause::kHoistLost, hoist_.counts());
  return taken;
}

Result<void> RecordInputs::check(const dds::StereoFrame& frame) const {
  if (frame.calibration() != 0 && frame.calibration() != calibration_)
    return Error{ErrorCode::kConfiguration, "--calibration",
                 "the camera's frames were taken with another one",
                 "give the folder that the camera and stereo services have"};
  if (frame.width() != rig_.left.width || frame.height() != rig_.left.height)
    return Error{ErrorCode::kConfiguration, "--calibration",
                 "is of " + std::to_string(rig_.left.width) + " x " +
                     std::to_string(rig_.left.height) + " pixels, the camera's frames have " +
                     std::to_string(frame.width()) + " x " + std::to_string(frame.height()),
                 "give the folder that the camera and stereo services have"};
  return {};
}

/// Counts what never arrived: numbers of one stream have no gaps at the source.
void RecordInputs::track(const dds::StereoFrame& frame) {
  if (frame.stream() == stream_ && frame.sequence_number() > sequence_ + 1)
    dropped_.add(Cause::kFrameMissing, frame.sequence_number() - sequence_ - 1);
  if (frame.stream() != stream_ || frame.sequence_number() > sequence_)
    sequence_ = frame.sequence_number();
  stream_ = frame.stream();
}

/// Whether both axes were recorded before that time: else nothing could be made of the frame.
bool RecordInputs::placed(TimeNs time) const {
  for (const auto sensor : {RecordingSink::Sensor::kCart, RecordingSink::Sensor::kTrolley}) {
    const TimeNs first = first_reading_[static_cast<std::size_t>(sensor)];
    if (first == 0 || first > time) return false;
  }
  return true;
}

Result<void> RecordInputs::take_frames(Recorder& recorder) {
  while (auto sample = frames_.take()) {
    const dds::StereoFrame& frame = **sample;
    if (!camera_gate_.pass(frame.stream(), sample->writer(), gone_from(frames_))) {
      dropped_.add(Cause::kSecondCamera);
      continue;
    }
    if (auto fits = check(frame); !fits) return fits;
    ++heard_.frames;
    if (frames_end_) continue;
    track(frame);
    const TimeNs time = frame.exposure_time_ns();
    if (!placed(time)) {
      dropped_.add(Cause::kRecordUnplaced);
      continue;
    }
    if (!follows(time, last_frame_)) {
      dropped_.add(Cause::kRecordOtherTime);
      continue;
    }
    const PixelFormat format = pixel_format(frame.encoding()).value_or(PixelFormat::kMono8);
    RecordedPair pair{time,
                      format,
                      frame.width(),
                      frame.height(),
                      image_of(frame, format, frame.left()),
                      image_of(frame, format, frame.right())};
    const bool intact = sample->intact();
    sample.reset();  // the camera's memory is not looked at any more
    if (!intact) {
      dropped_.add(Cause::kFrameOverwritten);
      continue;
    }
    if (recorder.put(std::move(pair)))
      last_frame_ = time;
    else
      dropped_.add(Cause::kRecordTooSlow);
  }
  return {};
}

void RecordInputs::take_positions(Recorder& recorder) {
  while (const auto sample = positions_.take()) {
    const v1::RangefinderPosition& p = **sample;
    using Sensor = RecordingSink::Sensor;
    const Sensor sensor = p.axis() == v1::AXIS_CART      ? Sensor::kCart
                          : p.axis() == v1::AXIS_TROLLEY ? Sensor::kTrolley
                                                         : Sensor::kCartSecond;
    const auto i = static_cast<std::size_t>(sensor);
    if (!position_gates_[i].pass(p.stream(), sample->writer(), gone_from(positions_))) {
      dropped_.add(sensor == Sensor::kTrolley ? Cause::kTrolleySecondSource
                                              : Cause::kCartSecondSource);
      continue;
    }
    ++heard_.readings[i];
    const bool good = p.device_status() == v1::STATUS_OK;
    const double nothing = std::numeric_limits<double>::quiet_NaN();
    if (!follows(p.time_ns(), last_reading_[i]))
      dropped_.add(Cause::kRecordOtherTime);
    else if (!recorder.put(RecordedReading{sensor, p.time_ns(), good ? p.distance_m() : nothing,
                                           p.accuracy_m()}))
      dropped_.add(Cause::kRecordTooSlow);
    else {
      last_reading_[i] = p.time_ns();
      if (first_reading_[i] == 0) first_reading_[i] = p.time_ns();
    }
  }
}

void RecordInputs::take_hoist(Recorder& recorder) {
  while (const auto sample = hoist_.take()) {
    const v1::HoistState& h = **sample;
    if (!hoist_gate_.pass(sample->writer())) {
      dropped_.add(Cause::kHoistSecondSource);
      continue;
    }
    if (h.status() == v1::STATUS_FAILED) {
      dropped_.add(Cause::kHoistFailed);
      continue;
    }
    const HoistReading r = dds::hoist_reading(h);
    if (!follows(r.time, last_hoist_))
      dropped_.add(Cause::kRecordOtherTime);
    else if (recorder.put(r))
      last_hoist_ = r.time;
    else
      dropped_.add(Cause::kRecordTooSlow);
  }
}

bool RecordInputs::all_heard() const {
  using Sensor = RecordingSink::Sensor;
  return heard_.frames > 0 && heard_.readings[static_cast<std::size_t>(Sensor::kCart)] > 0 &&
         heard_.readings[static_cast<std::size_t>(Sensor::kTrolley)] > 0;
}

std::string RecordInputs::missing() const {
  using Sensor = RecordingSink::Sensor;
  std::string out;
  if (heard_.frames == 0)
    out += whose(frames_.counts(), "stereo_frame", "cranemap-camera",
                 "is its camera connected and running? its log and /readyz say");
  for (const Sensor sensor : {Sensor::kCart, Sensor::kTrolley})
    if (heard_.readings[static_cast<std::size_t>(sensor)] == 0)
      out += (out.empty() ? "" : "; ") +
             whose(positions_.counts(),
                   sensor == Sensor::kCart ? "rangefinder_position of the cart"
                                           : "rangefinder_position of the trolley",
                   "cranemap-rangefinder", "is this axis among its rangefinders? its log says");
  return out;
}

bool RecordInputs::positions_follow() const {
  using Sensor = RecordingSink::Sensor;
  return last_reading_[static_cast<std::size_t>(Sensor::kCart)] > last_frame_ &&
         last_reading_[static_cast<std::size_t>(Sensor::kTrolley)] > last_frame_;
}

}  // namespace crane
