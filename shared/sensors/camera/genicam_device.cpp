// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/genicam_device.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace crane {
namespace {

/// GigE Vision counts 1 .. 65535, and again 1.
constexpr std::uint64_t kNumbers = 65'535;
constexpr std::uint64_t kLookAtPtpEvery = 64;
/// TAI is ahead of UTC by so much since 2017.
constexpr TimeNs kTaiAhead = 37 * kNsPerSecond;

std::string seconds_text(TimeNs time) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3f", double(time) * 1e-9);
  return text.data();
}

}  // namespace

GenicamDevice::GenicamDevice(GenicamOptions options, std::unique_ptr<GenicamIo> io,
                             std::function<ClockPair()> clocks)
    : options_(std::move(options)), io_(std::move(io)), clocks_(std::move(clocks)) {}

GenicamDevice::~GenicamDevice() {
  GenicamDevice::close();
}

void GenicamDevice::close() {
  if (std::exchange(open_, false)) io_->close();
  next_trigger_.reset();
  clock_.reset();
  source_ = {};
  ptp_.clear();
  by_ptp_ = by_arrival_ = false;
  given_ = false;
  seen_ = unwrapped_ = missed_ = 0;
  last_number_.reset();
  remark_.clear();
}

Result<void> GenicamDevice::open() {
  close();
  open_ = true;
  if (auto opened = io_->open(options_.camera); !opened) return opened;
  const auto clock = set_genicam(*io_, options_);
  if (!clock) return clock.error();
  source_ = *clock;
  if (source_.ptp_status != nullptr) look_at_ptp();
  return io_->start();
}

void GenicamDevice::look_at_ptp() {
  if (io_->has("PtpDataSetLatch")) (void)io_->command("PtpDataSetLatch");
  const auto status = io_->text(source_.ptp_status);
  ptp_ = status ? *status : status.error().what;
}

/// The newest picture that waits, with triggers given as they are due.
std::optional<GenicamPicture> GenicamDevice::newest(FrameSource::Deadline deadline,
                                                    DropCounts& dropped, Result<void>& triggered) {
  using Steady = std::chrono::steady_clock;
  const auto until = [&](Steady::time_point time) {
    return std::max(std::chrono::microseconds(0),
                    std::chrono::duration_cast<std::chrono::microseconds>(time - Steady::now()));
  };
  std::optional<GenicamPicture> held;
  if (options_.trigger == "software") {
    const std::chrono::nanoseconds period(static_cast<std::int64_t>(1e9 / options_.rate_hz));
    const auto after = [&](Steady::time_point now) {
      return Steady::time_point(now.time_since_epoch() / period * period + period);
    };
    if (!next_trigger_) next_trigger_ = after(Steady::now());
    held = io_->next(until(std::min(*next_trigger_, deadline)));
    if (!held && Steady::now() >= *next_trigger_) {
      next_trigger_ = after(Steady::now());
      triggered = io_->command("TriggerSoftware");
      if (!triggered) return std::nullopt;
      held = io_->next(until(std::min(*next_trigger_, deadline)));
    }
  } else {
    held = io_->next(until(deadline));
  }
  if (!held) return held;
  while (auto newer = io_->next(std::chrono::microseconds(0))) {
    dropped.add(held->state == GenicamPicture::State::kWhole ? Cause::kFrameOvertaken
                                                             : Cause::kPacketsLost);
    count(held->number);
    held = newer;
  }
  return held;
}

/// Numbers without their end, and what was left out of them.
void GenicamDevice::count(std::uint64_t number) {
  std::uint64_t step = 1;
  if (last_number_) {
    step = number - *last_number_;
    if (number < *last_number_ && *last_number_ <= kNumbers) step += kNumbers;
    if (step == 0 || step > kNumbers) step = 1;
  }
  last_number_ = number;
  unwrapped_ += step;
  if (seen_++ > 0) missed_ += step - 1;
}

TimeNs GenicamDevice::time_of(const GenicamPicture& p, FrameFacts& facts, DropCounts& dropped) {
  using Stamps = GenicamOptions::Stamps;
  const ClockPair now = clocks_();
  const TimeNs epoch_ahead = now.epoch - now.monotonic;
  TimeNs stamp = p.stamp;
  if (options_.stamps == Stamps::kChunk) {
    const auto ticks = io_->chunk("ChunkTimestamp");
    if (!ticks) return 0;
    stamp =
        source_.ticks_per_second == 1e9
            ? *ticks
            : static_cast<TimeNs>(std::llround(double(*ticks) * (1e9 / source_.ticks_per_second)));
  }
  // Where a camera has no clock, Aravis puts the time of arrival there.
  by_arrival_ = options_.stamps == Stamps::kArrival || stamp <= 0 || stamp == p.arrival;
  if (by_arrival_) return p.arrival;
  by_ptp_ = false;
  if (source_.ptp_status != nullptr) {
    if (seen_ % kLookAtPtpEvery == 0) look_at_ptp();
    if (ptp_ == "Slave" || ptp_ == "Master")
      for (const TimeNs ahead : {TimeNs{0}, kTaiAhead})
        if (std::abs(stamp - ahead - p.arrival) < kNsPerSecond) {
          by_ptp_ = true;
          return stamp - ahead;
        }
    remark_ = options_.camera + ": PTP is not in step (" + ptp_ +
              ") -> is ptp4l running on this network, and is this host's clock its own?";
  }
  const std::uint64_t steps = clock_.steps();
  const TimeNs host = clock_.to_host(stamp, p.arrival - epoch_ahead);
  dropped.add(Cause::kCameraClockSet, clock_.steps() - steps);
  ahead_ = clock_.offset() + epoch_ahead;
  facts.late_ms = double(clock_.late()) * 1e-6;
  return host + epoch_ahead;
}

/// False: counted and of no use.
bool GenicamDevice::use(const GenicamPicture& p, const FrameBuffers& out, FrameFacts& facts,
                        DropCounts& dropped) {
  const Stopwatch watch;
  const auto refuse = [&](Cause cause, const std::string& why) {
    dropped.add(cause);
    remark_ = options_.camera + ": " + why;
    return false;
  };
  if (p.state == GenicamPicture::State::kPacketsLost)
    return refuse(Cause::kPacketsLost,
                  "packets of pictures get lost -> a network card of its own, jumbo frames, "
                  "net.core.rmem_max, or a lower rate");
  const auto format = raw_format_of(p.pixel_format);
  const std::uint32_t width = options_.single ? options_.width : 2 * options_.width;
  if (p.state == GenicamPicture::State::kUnusable || !format || p.width != width ||
      p.height != options_.height)
    return refuse(Cause::kFrameShort,
                  "gives pictures of another size or format than was set -> "
                  "does another program use it?");
  const std::size_t row = crane::image_bytes(format->pixels, p.width, 1).value_or(0) + p.padding;
  const RawPicture picture{p.data, p.bytes, row, p.width, p.height, *format};
  if (auto done = unpack(picture, options_.swap, options_.camera, out, facts); !done)
    return refuse(Cause::kFrameShort, done.error().what);
  if (pair_swapped(out, facts))
    return refuse(Cause::kHalvesSwapped,
                  "left and right came the other way round -> if all frames do, set camera.swap");
  const TimeNs time = time_of(p, facts, dropped);
  if (time <= 0)
    return refuse(Cause::kExposureNotLater,
                  "pictures do not say when they were taken -> camera.stamps: camera or arrival");
  facts.exposure_time = time - options_.latency;
  facts.number = unwrapped_;
  facts.decode_ms = watch.ms();
  return true;
}

Result<bool> GenicamDevice::grab(const FrameBuffers& out, FrameFacts& facts,
                                 FrameSource::Deadline deadline, DropCounts& dropped) {
  const Error gone{ErrorCode::kNotAvailable, options_.camera, "does not answer any more",
                   "is it powered, is its cable in, did another program take it?"};
  if (io_->lost()) return gone;
  if (std::exchange(given_, false)) missed_ = 0;
  Result<void> triggered;
  const auto picture = newest(deadline, dropped, triggered);
  if (!triggered) return io_->lost() ? gone : triggered.error();
  if (!picture) return false;
  count(picture->number);
  remark_.clear();
  given_ = use(*picture, out, facts, dropped);
  return given_;
}

std::size_t GenicamDevice::image_bytes() const {
  const auto format = raw_format_of(options_.pixel_format);
  if (!format) return 0;
  return crane::image_bytes(format->pixels, options_.width, options_.height).value_or(0);
}

std::string GenicamDevice::about() const {
  if (seen_ == 0) return options_.camera;
  if (by_arrival_)
    return options_.camera + ": stamped when pictures arrive, late by readout and network";
  if (by_ptp_) return options_.camera + ": stamped by PTP";
  return options_.camera + ": stamped by its own clock, " + seconds_text(ahead_) +
         " s behind this host's, set " + std::to_string(clock_.steps()) + " times meanwhile";
}

}  // namespace crane
