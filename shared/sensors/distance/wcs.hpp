// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "sensors/distance/distance_protocol.hpp"

namespace crane {

/// Pepperl+Fuchs WCS read heads on a code rail, RS-485, data protocol 3 (types LSxx6 with even
/// parity, LSxx7 without): one byte asks, five answer: flags, a position of 19 bits in three bytes,
/// XOR of these four. A position of 0 is one. No byte of an answer has its highest bit set; those
/// that have are our own question, heard again on a line of two wires. Read head 0 is asked.
class WcsProtocol final : public DistanceProtocol {
 public:
  explicit WcsProtocol(double unit_m) : unit_m_(unit_m) {}

  [[nodiscard]] SerialLine line() const override { return {38'400, 'E', 8}; }
  [[nodiscard]] double unit_m() const override { return unit_m_; }
  [[nodiscard]] std::string ask(std::uint64_t /*n*/) override {
    forget();
    return "\x80";
  }
  [[nodiscard]] bool is_asked() const override { return true; }
  void take(std::span<const std::uint8_t> bytes, DeviceTalk& out) override;
  void forget() override {
    have_ = 0;
    answered_ = false;
  }

 private:
  void understand(DeviceTalk& out);

  double unit_m_;
  std::array<std::uint8_t, 5> frame_{};
  std::size_t have_ = 0;
  bool answered_ = false;  ///< what comes until the next question is no telegram
};

}  // namespace crane
