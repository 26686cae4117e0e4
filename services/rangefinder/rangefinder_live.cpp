// SPDX-License-Identifier: Apache-2.0
#include "rangefinder_live.hpp"

#include <algorithm>
#include <deque>
#include <mutex>
#include <random>
#include <thread>

#include "base/log.hpp"
#include "base/loop_watch.hpp"
#include "base/wakeup.hpp"
#include "bounds.h"
#include "sensors/distance/distance_device.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;
using Axis = RangefinderConfig::Axis;
using Health = DeviceState::Health;

/// Readings that wait to be published; the oldest go first. At 250 Hz a second's.
constexpr std::size_t kWaiting = 256;
/// A device's thread waits at most for a connection and between two tries.
constexpr std::chrono::milliseconds kDeviceTurnsWithin{15'000};

/// What the devices' threads hand to the service's.
class Inbox {
 public:
  explicit Inbox(Wakeup& wakeup) : wakeup_(wakeup) {}

  void put(const DistanceReading& reading) {
    const std::lock_guard lock(mutex_);
    if (readings_.size() == kWaiting) {
      readings_.pop_front();
      ++overflown_;
    }
    readings_.push_back(reading);
    wakeup_.notify();
  }
  void put(std::size_t device, const DeviceState& state) {
    const std::lock_guard lock(mutex_);
    states_[device] = state;
    wakeup_.notify();
  }
  std::deque<DistanceReading> take(std::map<std::size_t, DeviceState>& states,
                                   std::uint64_t& overflown) {
    const std::lock_guard lock(mutex_);
    states = states_;
    overflown = overflown_;
    return std::exchange(readings_, {});
  }

 private:
  Wakeup& wakeup_;
  std::mutex mutex_;
  std::deque<DistanceReading> readings_;
  std::map<std::size_t, DeviceState> states_;
  std::uint64_t overflown_ = 0;
};

/// Configurations that share a port are one device.
std::vector<std::vector<RangefinderConfig>> by_port(const std::vector<RangefinderConfig>& all,
                                                    const std::string& axis) {
  std::vector<std::vector<RangefinderConfig>> out;
  for (const RangefinderConfig& c : all) {
    if (!axis.empty() && axis_name(c.axis) != axis) continue;
    const auto same = std::find_if(out.begin(), out.end(), [&c](const auto& port) {
      return port.front().port == c.port && c.device == RangefinderConfig::Device::kTelegram;
    });
    if (same == out.end())
      out.push_back({c});
    else
      same->push_back(c);
  }
  return out;
}

class Live {
 public:
  Live(ServiceContext& context, std::vector<std::vector<RangefinderConfig>> ports,
       dds::Writer<dds::RangefinderPositionTopic> writer)
      : context_(context), ports_(std::move(ports)), writer_(std::move(writer)), inbox_(wakeup_) {
    status().stream = stream_;
  }

  Result<void> run() {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < ports_.size(); ++i)
      threads.emplace_back([this, i](const std::stop_token& stop) { follow(i, stop); });
    while (!context_.stopping()) {
      wakeup_.wait_for(50ms);
      publish();
      status().tick();
    }
    for (std::jthread& thread : threads) thread.request_stop();
    return {};
  }

 private:
  StatusReporter& status() { return context_.status; }

  void follow(std::size_t i, const std::stop_token& stop) {
    const std::string& port = ports_[i].front().port;
    name_thread(("range-" + axis_name(ports_[i].front().axis)).c_str());
    const LoopWatch::Mark mark =
        LoopWatch::of_process().watch("rangefinder " + port, kDeviceTurnsWithin);
    DistanceDevice device(ports_[i], make_distance_source(ports_[i]), clock_);
    device.follow(
        stop,
        [this, &mark](const DistanceReading& reading) {
          mark.turned();
          inbox_.put(reading);
        },
        [this, i, &mark](const DeviceState& state) {
          mark.turned();
          inbox_.put(i, state);
        });
    mark.rests();
  }

  void publish() {
    std::map<std::size_t, DeviceState> states;
    std::uint64_t overflown = 0;
    for (const DistanceReading& reading : inbox_.take(states, overflown)) send(reading);
    status().dropped.set(Cause::kReadingsWaited, overflown);
    report(states);
  }

  void send(const DistanceReading& reading) {
    const bool cart = reading.axis == Axis::kCart;
    ++status().received;
    if (!reading.good) status().dropped.add(reading.why);
    v1::RangefinderPosition sample;
    sample.crane(context_.participant->settings().crane);
    sample.axis(cart ? v1::AXIS_CART : v1::AXIS_TROLLEY);
    sample.stream(stream_);
    sample.sequence_number(sequence_[cart ? 0 : 1]++);
    sample.time_ns(reading.time);
    sample.distance_m(reading.distance_m);
    sample.accuracy_m(reading.accuracy_m);
    sample.device_status(reading.good ? v1::STATUS_OK : v1::STATUS_FAILED);
    if (auto sent = writer_.write(sample); !sent) {
      status().dropped.add(Cause::kNotAcceptedByDds);
      log_warning(sent.error().text());
      return;
    }
    ++status().published;
  }

  /// The worst that any device has to say.
  void report(const std::map<std::size_t, DeviceState>& states) {
    Health worst = states.size() < ports_.size() ? Health::kConnecting : Health::kGood;
    std::string text = states.size() < ports_.size() ? "connecting" : "";
    std::uint64_t damaged = 0;
    for (const auto& [i, state] : states) {
      const std::string axis = axis_name(ports_[i].front().axis);
      for (const auto& [name, value] : state.figures) status().values[axis + "_" + name] = value;
      status().values[axis + "_connections"] = double(state.connections);
      damaged += state.damaged;
      if (state.health != said_[i].health || state.text != said_[i].text) {
        if (!state.text.empty())
          log_warning(axis + ": " + state.text);
        else if (state.health == Health::kGood)
          log_info(axis + ": " + ports_[i].front().port + " measures");
        said_[i] = state;
      }
      if (state.health > worst || (state.health == worst && text.empty())) {
        worst = std::max(worst, state.health);
        text = state.text;
      }
    }
    status().dropped.set(Cause::kTelegramDamaged, damaged);
    status().status = worst == Health::kGood     ? v1::STATUS_OK
                      : worst == Health::kFailed ? v1::STATUS_FAILED
                                                 : v1::STATUS_DEGRADED;
    status().message = text;
  }

  ServiceContext& context_;
  std::vector<std::vector<RangefinderConfig>> ports_;
  dds::Writer<dds::RangefinderPositionTopic> writer_;
  SystemClock clock_;
  Wakeup wakeup_;
  Inbox inbox_;
  std::uint64_t stream_ = std::random_device{}() | 1U;
  std::uint64_t sequence_[2] = {0, 0};
  std::map<std::size_t, DeviceState> said_;
};

}  // namespace

Result<void> follow_rangefinders(ServiceContext& context, const std::string& axis) {
  auto ports = by_port(context.config.rangefinders, axis);
  if (ports.empty())
    return Error{ErrorCode::kConfiguration,
                 context.config_file.empty() ? "configuration" : context.config_file,
                 "names no rangefinders" + (axis.empty() ? "" : " of axis " + axis),
                 "add 'rangefinders' (docs/sensors.md), or give a RECORDING to play"};
  auto writer = dds::Writer<dds::RangefinderPositionTopic>::create(context.participant);
  if (!writer) return writer.error();
  return Live(context, std::move(ports), std::move(*writer)).run();
}

}  // namespace crane
