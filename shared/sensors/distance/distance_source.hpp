// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>

#include "base/result.hpp"
#include "config/site_config.hpp"
#include "sensors/distance/device_said.hpp"

namespace crane {

/// A way to distances that may come and go: opened, listened to until it fails, opened again.
class DistanceSource {
 public:
  virtual ~DistanceSource() = default;
  /// Error: Resource or Configuration, with what to do about it.
  virtual Result<void> open() = 0;
  /// What the device says within `limit`; nothing is fine. The last one of `out` has just arrived.
  /// Error: Resource when it is gone; then open() again.
  virtual Result<void> listen(std::chrono::milliseconds limit, DeviceTalk& out) = 0;
  /// In order, as far as it goes.
  virtual void close() = 0;
  /// Telegrams that were none, since the start.
  [[nodiscard]] virtual std::uint64_t damaged() const = 0;
  /// Before its telegram had arrived a measurement was so old already [ns], by the line alone.
  [[nodiscard]] virtual std::int64_t line_time_ns(std::size_t bytes) const {
    (void)bytes;
    return 0;
  }
};

/// Of one port. Several configurations, one for each channel, only where a PLC's telegrams carry
/// both positions.
std::unique_ptr<DistanceSource> make_distance_source(const std::vector<RangefinderConfig>& port);

}  // namespace crane
