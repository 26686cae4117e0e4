// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sensors/distance/distance_protocol.hpp"
#include "sensors/distance/telegram_frames.hpp"

namespace crane {

/// Any device that writes a number a line, with or without words around it: "12.345",
/// "D=+0012345mm". A line with no number, or with two, is damaged.
class TextLineProtocol final : public DistanceProtocol {
 public:
  /// `question`: sent for each reading; empty: the device streams.
  TextLineProtocol(double unit_m, std::string question)
      : unit_m_(unit_m), question_(std::move(question)) {}

  [[nodiscard]] SerialLine line() const override { return {115'200, 'N', 8}; }
  [[nodiscard]] double unit_m() const override { return unit_m_; }
  [[nodiscard]] std::string ask(std::uint64_t /*n*/) override { return question_; }
  [[nodiscard]] bool is_asked() const override { return !question_.empty(); }
  void take(std::span<const std::uint8_t> bytes, DeviceTalk& out) override;
  void forget() override { frames_.forget(); }

 private:
  double unit_m_;
  std::string question_;
  TextFrames frames_;
};

}  // namespace crane
