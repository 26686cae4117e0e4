// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "sensors/distance/distance_protocol.hpp"

namespace crane {

/// Benewake TF-Luna, TFmini-S, TF02-Pro, TF03: nine bytes 59 59 DL DH AL AH TL TH CS, streamed.
class BenewakeProtocol final : public DistanceProtocol {
 public:
  explicit BenewakeProtocol(double unit_m) : unit_m_(unit_m) {}

  [[nodiscard]] SerialLine line() const override { return {115'200, 'N', 8}; }
  [[nodiscard]] double unit_m() const override { return unit_m_; }
  void take(std::span<const std::uint8_t> bytes, DeviceTalk& out) override;
  void forget() override { have_ = 0; }

 private:
  double unit_m_;
  std::array<std::uint8_t, 9> frame_{};
  std::size_t have_ = 0;
};

}  // namespace crane
