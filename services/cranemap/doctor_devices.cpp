// SPDX-License-Identifier: Apache-2.0
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "base/format.hpp"
#include "doctor.hpp"
#include "sensors/distance/distance_device.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

Finding examine(const RangefinderConfig& c) {
  const std::string name = axis_name(c.axis) + " at " + c.port;
  SystemClock clock;
  DistanceDevice device({c}, make_distance_source({c}), clock);
  std::mutex mutex;
  std::condition_variable heard;
  std::optional<double> distance_m;
  DeviceState state;
  {
    const std::jthread follower([&](const std::stop_token& stop) {
      device.follow(
          stop,
          [&](const DistanceReading& reading) {
            const std::lock_guard lock(mutex);
            if (reading.good) distance_m = reading.distance_m;
            if (reading.good) heard.notify_one();
          },
          [&](const DeviceState& now) {
            const std::lock_guard lock(mutex);
            state = now;
          });
    });
    std::unique_lock lock(mutex);
    heard.wait_for(lock, 2s, [&] { return distance_m.has_value(); });
    lock.unlock();
  }
  if (distance_m)
    return {Finding::Verdict::kGood, "rangefinder",
            name + ": " + device_name(c.device) + formatted(" measures %.4f m", *distance_m), ""};
  const auto advice = state.text.find(" -> ");
  Finding finding{
      Finding::Verdict::kBad, "rangefinder",
      axis_name(c.axis) + ": " + state.text.substr(0, advice),
      advice == std::string::npos ? "see docs/sensors.md" : state.text.substr(advice + 4)};
  if (state.text.find("in use by another program") != std::string::npos) {
    finding.verdict = Finding::Verdict::kWarning;
    finding.advice = "a service follows it already, or another program must end";
  }
  return finding;
}

}  // namespace

std::vector<Finding> examine_rangefinders(const SiteConfig& config) {
  std::vector<Finding> out;
  for (const RangefinderConfig& c : config.rangefinders) out.push_back(examine(c));
  return out;
}

}  // namespace crane
