// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "base/result.hpp"
#include "sensors/distance/emulators.hpp"

namespace crane {

/// The other end of a ModbusSource: libmodbus's server with the position in the registers that the
/// configuration names. One thread.
class ModbusEmulator {
 public:
  /// Listens where config.port says, "tcp://127.0.0.1:502"; port 0: one that is free.
  static Result<std::unique_ptr<ModbusEmulator>> listen(const RangefinderConfig& config);
  ~ModbusEmulator();
  ModbusEmulator(const ModbusEmulator&) = delete;
  ModbusEmulator& operator=(const ModbusEmulator&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  /// Puts the measurement into the registers; the heartbeat moves on unless it is `broken`. Without
  /// a target a float is not a number, an integer 0.
  void measure(const EmulatedMeasurement& now);
  /// Answers who asks within `limit`, at most 4 at once.
  void answer(std::chrono::milliseconds limit);

 private:
  struct Server;
  explicit ModbusEmulator(std::unique_ptr<Server> server);
  std::unique_ptr<Server> server_;
};

}  // namespace crane
