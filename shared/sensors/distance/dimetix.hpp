// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sensors/distance/distance_protocol.hpp"
#include "sensors/distance/telegram_frames.hpp"

namespace crane {

/// Dimetix DLS, FLS and D series, and the Leica DISTO modules of that family: lines "g0h+00012345",
/// or "g0@E255" for an error. Device id 0.
class DimetixProtocol final : public DistanceProtocol {
 public:
  DimetixProtocol(double unit_m, bool polled) : unit_m_(unit_m), polled_(polled) {}

  [[nodiscard]] SerialLine line() const override { return {19'200, 'N', 8}; }
  [[nodiscard]] double unit_m() const override { return unit_m_; }
  /// Stops what goes on, then tracks.
  [[nodiscard]] std::string begin() const override {
    return polled_ ? "s0c\r\n" : "s0c\r\ns0h\r\n";
  }
  [[nodiscard]] std::string end() const override { return "s0c\r\n"; }
  [[nodiscard]] std::string ask(std::uint64_t /*n*/) override { return polled_ ? "s0g\r\n" : ""; }
  [[nodiscard]] bool is_asked() const override { return polled_; }
  void take(std::span<const std::uint8_t> bytes, DeviceTalk& out) override;
  void forget() override { frames_.forget(); }

 private:
  bool understand(const TextFrames::Frame& frame, DeviceTalk& out) const;
  double unit_m_;
  bool polled_;
  TextFrames frames_;
};

}  // namespace crane
