// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/distance_device.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>

namespace crane {
namespace {

using namespace std::chrono_literals;
using Health = DeviceState::Health;

constexpr double kFirstWaitMs = 100, kLongestWaitMs = 2000;
constexpr auto kListen = 20ms, kTellEvery = 1000ms;
/// So much that is no telegram, and not one that is: not silence, but a line set wrongly.
constexpr std::uint64_t kGarbage = 5;

}  // namespace

DistanceDevice::DistanceDevice(std::vector<RangefinderConfig> port,
                               std::unique_ptr<DistanceSource> source, const Clock& clock)
    : port_(std::move(port)), source_(std::move(source)), clock_(clock), wait_ms_(kFirstWaitMs) {}

void DistanceDevice::say(Health health, const std::string& text) {
  changed_ |= health != state_.health || text != state_.text;
  state_.health = health;
  state_.text = text;
}

void DistanceDevice::fail(Cause why, const std::string& text, const Told& told) {
  say(Health::kFailed, text);
  // Said to be failed rather than left out: the mapper then knows why there is a gap.
  for (const RangefinderConfig& channel : port_)
    told({channel.axis, clock_.now(), 0, false, why, channel.accuracy_m});
}

std::string DistanceDevice::garbage() const {
  const RangefinderConfig& c = port_.front();
  const std::string device = device_name(c.device);
  if (!c.port.starts_with("/"))
    return c.port + ": what arrives are no telegrams of " + device + " -> check device and port";
  return c.port + ": what arrives are no telegrams of " + device +
         " -> check device, baud and parity; RS-422 also the order of the two wires";
}

void DistanceDevice::pause(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wakes;
  std::unique_lock lock(mutex);
  wakes.wait_for(lock, stop, std::chrono::duration<double, std::milli>(wait_ms_),
                 [] { return false; });
  wait_ms_ = std::min(2 * wait_ms_, kLongestWaitMs);
}

void DistanceDevice::hear(const DeviceTalk& talk, const Told& told) {
  using Kind = DeviceSaid::Kind;
  for (const DeviceSaid& said : talk) {
    const RangefinderConfig& c = port_[std::min(said.channel, port_.size() - 1)];
    DistanceReading reading{c.axis,
                            clock_.now() - source_->line_time_ns(said.bytes),
                            0,
                            false,
                            Cause::kDeviceGaveNoDistance,
                            c.accuracy_m};
    switch (said.kind) {
      case Kind::kFigure:
        state_.figures[said.text] = said.value;
        continue;
      case Kind::kWell:
        warning_.clear();
        continue;
      case Kind::kWarning:
        warning_ = c.port + ": " + said.text;
        continue;
      case Kind::kFault:
        reading.why = Cause::kDeviceFault;
        say(Health::kFailed, c.port + ": " + said.text);
        break;
      case Kind::kNoDistance:
        say(Health::kFailed, c.port + ": no distance: " + said.text);
        break;
      case Kind::kDistance: {
        const double distance_m = said.value * c.scale;
        if (!std::isfinite(distance_m) || distance_m < c.min_m || distance_m > c.max_m) {
          reading.why = Cause::kBeyondDeviceRange;
          say(Health::kFailed,
              c.port + ": reads " + std::to_string(distance_m) + " m, outside min_m and max_m");
          break;
        }
        reading.distance_m = distance_m;
        reading.good = true;
        wait_ms_ = kFirstWaitMs;
        say(warning_.empty() ? Health::kGood : Health::kWarning, warning_);
        break;
      }
    }
    ++state_.readings;
    told(reading);
  }
}

void DistanceDevice::follow(const std::stop_token& stop, const Told& told, const Changed& changed) {
  using Steady = std::chrono::steady_clock;
  auto told_at = Steady::now();
  const auto tell = [&] {
    state_.damaged = source_->damaged();
    if (!changed_ && Steady::now() - told_at < kTellEvery) return;
    changed_ = false;
    told_at = Steady::now();
    changed(state_);
  };
  const std::string name = port_.front().port;
  const auto silence = std::chrono::milliseconds(port_.front().silence_ms);
  DeviceTalk talk;
  while (!stop.stop_requested()) {
    if (auto opened = source_->open(); !opened) {
      fail(Cause::kDeviceSilent, opened.error().text(), told);
      tell();
      pause(stop);
      continue;
    }
    ++state_.connections;
    std::uint64_t damaged_then = source_->damaged();
    auto heard_at = Steady::now();
    while (!stop.stop_requested()) {
      talk.clear();
      const auto listened = source_->listen(kListen, talk);
      if (!talk.empty()) {
        heard_at = Steady::now();
        damaged_then = source_->damaged();
      }
      hear(talk, told);
      if (!listened) {
        fail(Cause::kDeviceSilent, listened.error().text(), told);
        break;
      }
      if (Steady::now() - heard_at > silence) {
        const bool noise = source_->damaged() - damaged_then >= kGarbage;
        fail(noise ? Cause::kTelegramDamaged : Cause::kDeviceSilent,
             noise ? garbage()
                   : name + ": silent for " + std::to_string(silence.count()) +
                         " ms -> is it switched on, and its beam or cable whole?",
             told);
        break;
      }
      tell();
    }
    if (stop.stop_requested()) source_->close();
    tell();
    if (!stop.stop_requested()) pause(stop);
  }
}

}  // namespace crane
