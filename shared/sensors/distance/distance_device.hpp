// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stop_token>
#include <string>

#include "base/clock.hpp"
#include "base/drop_counts.hpp"
#include "config/site_config.hpp"
#include "sensors/distance/distance_source.hpp"

namespace crane {

/// One reading of one axis, good or not.
struct DistanceReading {
  RangefinderConfig::Axis axis = RangefinderConfig::Axis::kCart;
  TimeNs time = 0;  ///< of the measurement as far as we know: its arrival less its way on the line
  double distance_m = 0;
  bool good = false;
  Cause why = Cause::kDeviceGaveNoDistance;  ///< it is not good
  double accuracy_m = 0;
};

/// How a device is.
struct DeviceState {
  enum class Health { kConnecting, kGood, kWarning, kFailed };
  Health health = Health::kConnecting;
  std::string text;                       ///< what is the matter, and what to do; empty: nothing
  std::map<std::string, double> figures;  ///< "level_db", "temperature_c"
  std::uint64_t readings = 0, damaged = 0, connections = 0;
};

/// Follows one device for as long as it is told to: connects, asks, turns what it says into
/// readings, says what is wrong, connects again. Plugging out and in, power failures and silence
/// end nothing.
class DistanceDevice {
 public:
  using Told = std::function<void(const DistanceReading&)>;
  using Changed = std::function<void(const DeviceState&)>;

  /// `port`: the configurations of one port, of different axes.
  DistanceDevice(std::vector<RangefinderConfig> port, std::unique_ptr<DistanceSource> source,
                 const Clock& clock);

  /// Until it is to stop. Both functions are called on this thread; `changed` when health or text
  /// do, and once a second.
  void follow(const std::stop_token& stop, const Told& told, const Changed& changed);

 private:
  void hear(const DeviceTalk& talk, const Told& told);
  void say(DeviceState::Health health, const std::string& text);
  void fail(Cause why, const std::string& text, const Told& told);
  [[nodiscard]] std::string garbage() const;
  void pause(const std::stop_token& stop);

  std::vector<RangefinderConfig> port_;
  std::unique_ptr<DistanceSource> source_;
  const Clock& clock_;
  DeviceState state_;
  bool changed_ = true;
  double wait_ms_ = 0;
  std::string warning_;
};

}  // namespace crane
