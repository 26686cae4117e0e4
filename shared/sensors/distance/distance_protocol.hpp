// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "config/site_config.hpp"
#include "sensors/distance/device_said.hpp"

namespace crane {

/// How a serial device is set when it leaves its maker, as far as its manual says.
struct SerialLine {
  int baud = 115'200;
  char parity = 'N';  ///< N, E or O
  int data_bits = 8;
};

/// What one make of rangefinder says and wants to hear. Bytes in, telegrams out; no clock, no
/// device. Whatever arrives is hostile: memory is bounded, and what is no telegram is counted.
/// Sources of the telegrams: the makers' manuals, named in docs/sensors.md.
class DistanceProtocol {
 public:
  virtual ~DistanceProtocol() = default;

  [[nodiscard]] virtual SerialLine line() const = 0;
  /// Length of one unit of its distances [m], unless the site's configuration says another; 0: the
  /// maker leaves it to the customer, so the configuration must say it.
  [[nodiscard]] virtual double unit_m() const = 0;
  /// To be sent when a connection begins, and when it ends in order.
  [[nodiscard]] virtual std::string begin() const { return {}; }
  [[nodiscard]] virtual std::string end() const { return {}; }
  /// To be sent every interval, `n` times so far: a question for a distance, or for its health.
  [[nodiscard]] virtual std::string ask(std::uint64_t n) {
    (void)n;
    return {};
  }
  /// Whether it says distances only when it is asked.
  [[nodiscard]] virtual bool is_asked() const { return false; }

  /// Appends what the bytes complete. Telegrams may come in any pieces.
  virtual void take(std::span<const std::uint8_t> bytes, DeviceTalk& out) = 0;
  /// A connection was lost: what was begun will not be ended.
  virtual void forget() = 0;
  /// Telegrams that were none: wrong length, character, checksum.
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }

 protected:
  std::uint64_t damaged_ = 0;
};

/// Of config.device. nullptr for `modbus`, which is no stream of bytes (ModbusSource).
std::unique_ptr<DistanceProtocol> make_distance_protocol(const RangefinderConfig& config);

}  // namespace crane
