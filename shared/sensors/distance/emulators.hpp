// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "config/site_config.hpp"

namespace crane {

/// What an emulated device measures, and how it is.
struct EmulatedMeasurement {
  double distance_m = 0;
  bool no_target = false;  ///< as the device says that: 0, nines, an error, a bit
  bool dirty = false;      ///< it warns, as far as it can
  bool broken = false;     ///< it reports an error, as far as it can
};

/// The other end of a DistanceProtocol: says what the device would. After the same manuals, written
/// apart from the decoders. No clock, no line.
class DistanceEmulator {
 public:
  virtual ~DistanceEmulator() = default;
  /// What the host sent, in any pieces; returns the answers.
  virtual std::string hear(std::string_view bytes, const EmulatedMeasurement& now) = 0;
  /// The next telegram of a stream; empty while it is not streaming.
  virtual std::string stream(const EmulatedMeasurement& now) = 0;
};

/// Of config.device; nullptr for `modbus`.
std::unique_ptr<DistanceEmulator> make_distance_emulator(const RangefinderConfig& config);

}  // namespace crane
