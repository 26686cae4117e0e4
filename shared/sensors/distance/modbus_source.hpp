// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "sensors/distance/distance_source.hpp"

namespace crane {

/// A position in registers of a PLC, Modbus TCP ("tcp://host:502"), polled. With a heartbeat
/// register, a PLC that stands still is noticed.
class ModbusSource final : public DistanceSource {
 public:
  explicit ModbusSource(const RangefinderConfig& config);
  ~ModbusSource() override;

  Result<void> open() override;
  Result<void> listen(std::chrono::milliseconds limit, DeviceTalk& out) override;
  void close() override;
  [[nodiscard]] std::uint64_t damaged() const override { return damaged_; }

 private:
  struct Connection;
  Result<void> read(int first, int count, std::uint16_t* out);
  RangefinderConfig config_;
  std::unique_ptr<Connection> connection_;
  std::chrono::steady_clock::time_point next_;
  std::uint64_t damaged_ = 0;
  std::uint16_t heartbeat_ = 0;
  int same_ = -1;  ///< readings with this heartbeat; -1 = none yet
};

}  // namespace crane
