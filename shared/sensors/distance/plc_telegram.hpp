// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sensors/distance/distance_protocol.hpp"

namespace crane {

/// A telegram of fixed length as PLCs send them ("open user communication"): the position at a
/// byte offset, a heartbeat counter at another. Over UDP each datagram is one telegram; over TCP
/// they follow each other. A heartbeat that stands still is a PLC that stands still.
class PlcTelegram final : public DistanceProtocol {
 public:
  explicit PlcTelegram(const PlcTelegramConfig& config) : config_(config) {}

  [[nodiscard]] SerialLine line() const override { return {}; }
  [[nodiscard]] double unit_m() const override { return config_.unit_m; }
  void take(std::span<const std::uint8_t> bytes, DeviceTalk& out) override;
  void forget() override {
    bytes_.clear();
    heard_ = false;
  }

 private:
  void understand(std::span<const std::uint8_t> telegram, DeviceTalk& out);
  PlcTelegramConfig config_;
  std::vector<std::uint8_t> bytes_;
  bool heard_ = false;
  std::uint64_t heartbeat_ = 0;
  int same_ = 0;  ///< telegrams with this heartbeat
};

/// A number of a telegram or of registers, `bytes` in network order unless `little`.
/// NaN where it is none (a float of the PLC's that is NaN or infinite).
double plc_number(std::span<const std::uint8_t> bytes, PlcNumber type, bool little);

}  // namespace crane
