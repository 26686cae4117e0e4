// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/live_source.hpp"

#include <algorithm>
#include <utility>

namespace crane {
namespace {

constexpr TimeNs kFirstWait = kNsPerSecond / 4, kLongestWait = 8 * kNsPerSecond;
/// The longest sleep in one call of next(): the service has to do other things too.
constexpr TimeNs kNap = kNsPerSecond / 20;

}  // namespace

LiveSource::LiveSource(std::unique_ptr<StereoDevice> device, const Clock& clock,
                       std::function<void(TimeNs)> sleep_until,
                       std::function<std::uint64_t()> draw_stream)
    : device_(std::move(device)),
      clock_(clock),
      sleep_until_(std::move(sleep_until)),
      draw_stream_(std::move(draw_stream)) {}

LiveSource::~LiveSource() {
  if (connected_) device_->close();
}

void LiveSource::begin_stream() {
  stream_ = draw_stream_();
  sequence_ = 0;
  last_time_ = 0;
}

Result<FrameSource::Next> LiveSource::connect() {
  const TimeNs now = clock_.now();
  if (now < retry_at_) {
    sleep_until_(std::min(retry_at_, now + kNap));
    if (clock_.now() < retry_at_) return Next::kNothing;
  }
  if (auto opened = device_->open(); !opened) {
    device_->close();
    return lose(opened.error());
  }
  connected_ = true;
  heard_ = clock_.now();
  begin_stream();
  return Next::kNothing;
}

Result<FrameSource::Next> LiveSource::lose(const Error& why) {
  if (std::exchange(connected_, false)) {
    device_->close();
    dropped_.add(Cause::kCameraLost);
  }
  if (why.code == ErrorCode::kConfiguration) return why;
  wait_ = wait_ == 0 ? kFirstWait : std::min(2 * wait_, kLongestWait);
  retry_at_ = clock_.now() + wait_;
  trouble_ = why.text();
  return Next::kNothing;
}

Result<FrameSource::Next> LiveSource::silent() {
  const Error why{ErrorCode::kNotAvailable, "camera",
                  "has given no usable pair for 5 s although it is connected" +
                      (device_->remark().empty() ? "" : "; the last: " + device_->remark()),
                  "is it on, is it triggered, is its cable sound?"};
  heard_ = clock_.now();
  if (device_->reconnects_when_silent()) return lose(why);
  trouble_ = why.text();
  return Next::kNothing;
}

Result<FrameSource::Next> LiveSource::next(const FrameBuffers& out, FrameFacts& facts,
                                           Deadline deadline) {
  if (!connected_) return connect();
  const Result<bool> got = device_->grab(out, facts, deadline, dropped_);
  if (!got) return lose(got.error());
  if (!*got) {
    if (!device_->remark().empty()) trouble_ = device_->remark();
    return clock_.now() - heard_ < kSilent ? Next::kNothing : silent();
  }
  ++received_;
  heard_ = clock_.now();
  if (last_time_ > 0 && facts.exposure_time <= last_time_) {
    if (last_time_ - facts.exposure_time < kNsPerSecond) {
      dropped_.add(Cause::kExposureNotLater);
      return Next::kNothing;
    }
    dropped_.add(Cause::kCameraClockSet);
    begin_stream();
  }
  // A gap in the numbers is a loss, as the device counts it.
  sequence_ += last_time_ > 0 ? static_cast<std::int64_t>(device_->missed()) : 0;
  if (last_time_ > 0 && device_->missed() > 0)
    dropped_.add(Cause::kCameraMissedFrame, device_->missed());
  last_time_ = facts.exposure_time;
  wait_ = 0;  // it works: the next loss is looked into at once
  trouble_ = device_->remark();
  facts.stream = stream_;
  facts.sequence = sequence_++;
  facts.after = -1;
  return Next::kFrame;
}

}  // namespace crane
