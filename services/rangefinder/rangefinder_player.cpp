// SPDX-License-Identifier: Apache-2.0
#include "rangefinder_player.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/log.hpp"
#include "bounds.h"
#include "dds/hoist_reading.hpp"
#include "rangefinder_live.hpp"
#include "recording/recording.hpp"
#include "service/player.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

/// Of a rangefinder, or of the controller.
struct Reading {
  TimeNs time;
  double distance_m = 0;
  std::uint32_t axis = 0;
  const HoistReading* hoist = nullptr;
};

class Player {
 public:
  Player(ServiceContext& context, const PlayOptions& options, Recording recording, PlayRate rate,
         dds::Writer<dds::RangefinderPositionTopic> writer,
         std::optional<dds::Writer<dds::HoistStateTopic>> hoist_writer)
      : context_(context),
        options_(options),
        recording_(std::move(recording)),
        rate_(rate),
        stamp_offset_(stamp_offset(options, rate, recording_.start(), recording_.end())),
        writer_(std::move(writer)),
        hoist_writer_(std::move(hoist_writer)) {
    for (const RecordedDistance& d : recording_.cart())
      readings_.push_back({d.time, d.distance_m, v1::AXIS_CART});
    for (const RecordedDistance& d : recording_.trolley())
      readings_.push_back({d.time, d.distance_m, v1::AXIS_TROLLEY});
    for (const RecordedDistance& d : recording_.cart_second())
      readings_.push_back({d.time, d.distance_m, v1::AXIS_CART_SECOND});
    for (const HoistReading& h : recording_.hoist()) readings_.push_back({h.time, 0, 0, &h});
    std::stable_sort(readings_.begin(), readings_.end(),
                     [](const Reading& a, const Reading& b) { return a.time < b.time; });
  }

  Result<void> play() {
    status().expected = options_.loop ? 0 : readings_.size();
    status().stream = options_.stream;
    log_info("plays as soon as rangefinder_position has a reader");
    wait_for_reader(writer_, context_);
    Result<void> played = rate_.paced_by_map() ? play_paced() : play_timed();
    if (!played || context_.stopping()) return played;
    wait_until_taken(writer_, context_);
    status().finished = true;
    status().tick(true);
    log_info("end of the recording: " + std::to_string(status().published) + " readings published");
    return {};
  }

 private:
  StatusReporter& status() { return context_.status; }

  Result<void> play_timed() {
    const PlayClock clock = play_clock(options_, rate_, recording_.start());
    for (std::size_t n = 0; (options_.loop || n < readings_.size()) && !context_.stopping(); ++n) {
      const Reading& r = readings_[n % readings_.size()];
      const TimeNs time =
          r.time + static_cast<TimeNs>(n / readings_.size()) * recording_.loop_period();
      if (options_.resume && clock.due(time) < MonotonicClock().now() - kNsPerSecond) {
        status().dropped.add(Cause::kSkippedAfterRestart);
        continue;
      }
      wait_until(clock.due(time), context_);
      if (context_.stopping()) break;
      send(r, time);
    }
    return {};
  }

  /// Readings up to a few frames beyond what the map has accounted for; sent again when the mapper
  /// falls back, or when nothing moves.
  Result<void> play_paced() {
    Wakeup wakeup;
    auto progress = MapProgress::create(context_.participant, &wakeup, options_.stream);
    if (!progress) return progress.error();
    constexpr std::int64_t kAhead = 5;
    constexpr TimeNs kMargin = kNsPerSecond;
    const auto frames = static_cast<std::int64_t>(recording_.frames().size());
    std::int64_t accounted = -2;
    std::size_t next = 0;
    int resends = 0;
    Stopwatch since_progress;
    while (!context_.stopping()) {
      const std::int64_t heard = progress->poll().value_or(-1);
      const bool stuck = since_progress.ms() > double(kResendAfter.count());
      if (heard < accounted || accounted == -2 || stuck) {
        const TimeNs from =
            recording_.frame_time(std::clamp<std::int64_t>(heard + 1, 0, frames - 1)) - kMargin;
        next = static_cast<std::size_t>(
            std::lower_bound(readings_.begin(), readings_.end(), from,
                             [](const Reading& r, TimeNs t) { return r.time < t; }) -
            readings_.begin());
      }
      if (heard != accounted) resends = 0;
      if (stuck && ++resends > kMaxResends)
        return Error{
            ErrorCode::kResource, "rangefinder_position",
            "no map has accounted for frame " + std::to_string(accounted + 1) +
                " although its positions were sent " + std::to_string(resends) + " times",
            "are its images readable, and cranemap-camera, -stereo and -mapper running for "
            "this crane and domain?"};
      if (heard != accounted || stuck) since_progress = {};
      accounted = heard;
      const bool all = accounted + kAhead >= frames;
      const TimeNs until =
          all ? readings_.back().time : recording_.frame_time(accounted + kAhead) + kMargin;
      for (; next < readings_.size() && readings_[next].time <= until; ++next)
        send(readings_[next], readings_[next].time);
      if (accounted >= frames - 1) return {};
      status().tick();
      wakeup.wait_for(20ms);
    }
    return {};
  }

  void send(const Reading& r, TimeNs time) {
    if (r.hoist != nullptr) return send(*r.hoist, time);
    if (!std::isfinite(r.distance_m)) {
      // Said to be failed rather than left out: the mapper then knows why there is a gap.
      status().dropped.add(Cause::kDeviceGaveNoDistance);
    }
    v1::RangefinderPosition sample;
    const bool cart = r.axis != v1::AXIS_TROLLEY;
    const RangefinderModel& model = cart ? recording_.cart_model() : recording_.trolley_model();
    sample.crane(context_.participant->settings().crane);
    sample.axis(r.axis);
    sample.stream(options_.stream);
    sample.sequence_number(sequence_[r.axis - v1::AXIS_CART]++);
    sample.time_ns(time + stamp_offset_);
    sample.distance_m(std::isfinite(r.distance_m) ? r.distance_m : 0);
    sample.accuracy_m(model.accuracy_m);
    const bool in_range = std::abs(r.distance_m) <= model.range_m;
    if (std::isfinite(r.distance_m) && !in_range) status().dropped.add(Cause::kBeyondDeviceRange);
    sample.device_status(in_range ? v1::STATUS_OK : v1::STATUS_FAILED);
    ++status().received;
    count(writer_.write(sample));
  }

  void send(const HoistReading& r, TimeNs time) {
    v1::HoistState sample = dds::hoist_state(r);
    sample.crane(context_.participant->settings().crane);
    sample.sequence_number(hoist_sequence_++);
    sample.time_ns(time + stamp_offset_);
    ++status().received;
    count(hoist_writer_->write(sample));
  }

  void count(const Result<void>& sent) {
    if (sent) {
      ++status().published;
      return;
    }
    status().dropped.add(Cause::kNotAcceptedByDds);
    log_warning(sent.error().text());
  }

  ServiceContext& context_;
  const PlayOptions& options_;
  Recording recording_;
  PlayRate rate_;
  TimeNs stamp_offset_;
  dds::Writer<dds::RangefinderPositionTopic> writer_;
  std::optional<dds::Writer<dds::HoistStateTopic>> hoist_writer_;  ///< where it was recorded
  std::vector<Reading> readings_;
  std::uint64_t sequence_[3] = {0, 0, 0}, hoist_sequence_ = 0;
};

}  // namespace

int run_rangefinder(int argc, char** argv) {
  PlayOptions options;
  std::string axis;
  const ServiceInfo info{
      "cranemap-rangefinder",
      "Publishes what the rangefinders of the configuration measure as topic "
      "rangefinder_position.\nExample: cranemap-rangefinder --config site.yaml\n"
      "With a RECORDING: plays its cart and trolley instead, and where it has hoist0, that as "
      "hoist_state\nin place of the controller.\n"
      "Example: cranemap-rangefinder RECORDING --rate real",
      v1::SERVICE_RANGEFINDER};
  return run_service(
      argc, argv, info,
      [&](CLI::App& app) {
        add_play_options(app, options);
        app.get_option("RECORDING")->required(false);
        app.add_option("--axis", axis, "Only the rangefinders of this axis")
            ->check(CLI::IsMember({"cart", "trolley"}));
      },
      [&](ServiceContext& context) -> Result<void> {
        if (options.recording.empty()) return follow_rangefinders(context, axis);
        auto recording = Recording::open(options.recording);
        if (!recording) return recording.error();
        auto rate = check_play_options(options);
        if (!rate) return rate.error();
        auto writer = dds::Writer<dds::RangefinderPositionTopic>::create(context.participant);
        if (!writer) return writer.error();
        std::optional<dds::Writer<dds::HoistStateTopic>> hoist;
        if (!recording->hoist().empty()) {
          auto made = dds::Writer<dds::HoistStateTopic>::create(context.participant);
          if (!made) return made.error();
          hoist.emplace(std::move(*made));
        }
        return Player(context, options, std::move(*recording), *rate, std::move(*writer),
                      std::move(hoist))
            .play();
      });
}

}  // namespace crane
