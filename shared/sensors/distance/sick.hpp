// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sensors/distance/distance_protocol.hpp"
#include "sensors/distance/telegram_frames.hpp"

namespace crane {

/// SICK DL100 Pro (RS-422, manual 8014753), DL50 Hi (8013814) and DT1000/DL1000 (CoLa A). Three
/// dialects of ASCII telegrams in STX and ETX, or in lines. None has a checksum: digits are
/// counted.
class SickProtocol final : public DistanceProtocol {
 public:
  enum class Model { kDl100, kDl50, kDt1000 };
  /// `polled`: is asked for each distance; else the device streams, and is asked for its health.
  SickProtocol(Model model, double unit_m, bool polled)
      : model_(model), unit_m_(unit_m), polled_(polled || model == Model::kDt1000) {}

  [[nodiscard]] SerialLine line() const override;
  [[nodiscard]] double unit_m() const override { return unit_m_; }
  [[nodiscard]] std::string begin() const override;
  [[nodiscard]] std::string end() const override;
  [[nodiscard]] std::string ask(std::uint64_t n) override;
  [[nodiscard]] bool is_asked() const override { return polled_; }
  void take(std::span<const std::uint8_t> bytes, DeviceTalk& out) override;
  void forget() override;

 private:
  bool understand(const TextFrames::Frame& frame, DeviceTalk& out);
  bool distance(std::string_view digits, std::size_t bytes, DeviceTalk& out);
  void measured(long counts, std::size_t bytes, DeviceTalk& out);
  void status(std::uint32_t errors, std::uint32_t warnings, DeviceTalk& out);

  Model model_;
  double unit_m_;
  bool polled_;
  TextFrames frames_;
  std::string fault_;
};

}  // namespace crane
