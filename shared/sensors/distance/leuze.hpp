// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "sensors/distance/distance_protocol.hpp"

namespace crane {

/// Leuze BPS 8 and BPS 300i, which read a bar code tape: six bytes, status, position as signed
/// 32-bit big-endian number, XOR of these five. A position of 0 is one. Always asked: in a stream
/// of equal telegrams any six bytes have the right XOR, so that only a question tells where one
/// begins.
class LeuzeProtocol final : public DistanceProtocol {
 public:
  explicit LeuzeProtocol(double unit_m) : unit_m_(unit_m) {}

  [[nodiscard]] SerialLine line() const override { return {38'400, 'N', 8}; }
  [[nodiscard]] double unit_m() const override { return unit_m_; }
  /// Stops a stream that somebody began.
  [[nodiscard]] std::string begin() const override { return "\xC0\xF3\x33"; }
  [[nodiscard]] std::string ask(std::uint64_t /*n*/) override {
    forget();
    return "\xC0\xF1\x31";
  }
  [[nodiscard]] bool is_asked() const override { return true; }
  void take(std::span<const std::uint8_t> bytes, DeviceTalk& out) override;
  void forget() override {
    have_ = 0;
    answered_ = false;
  }

 private:
  double unit_m_;
  std::array<std::uint8_t, 6> frame_{};
  std::size_t have_ = 0;
  bool answered_ = false;  ///< what comes until the next question is no telegram
};

}  // namespace crane
