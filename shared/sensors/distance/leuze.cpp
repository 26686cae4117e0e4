// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/leuze.hpp"

namespace crane {

void LeuzeProtocol::take(std::span<const std::uint8_t> bytes, DeviceTalk& out) {
  using Kind = DeviceSaid::Kind;
  for (const std::uint8_t byte : bytes) {
    if (answered_) {
      ++damaged_;
      continue;
    }
    frame_[have_++] = byte;
    if (have_ < frame_.size()) continue;
    answered_ = true;
    std::uint8_t check = 0;
    for (std::size_t i = 0; i < 5; ++i) check ^= frame_[i];
    constexpr std::uint8_t kUnused = 0x80;
    if (check != frame_[5] || (frame_[0] & kUnused) != 0) {
      ++damaged_;
      continue;
    }
    const std::uint8_t status = frame_[0];
    const auto position = static_cast<std::int32_t>(
        std::uint32_t{frame_[1]} << 24U | std::uint32_t{frame_[2]} << 16U |
        std::uint32_t{frame_[3]} << 8U | std::uint32_t{frame_[4]});
    constexpr std::uint8_t kError = 1, kOut = 2, kDiagnostics = 4, kSleep = 16;
    if ((status & kError) != 0)
      out.push_back({Kind::kFault, 0, "device reports an error", frame_.size()});
    else if ((status & kOut) != 0)
      out.push_back({Kind::kNoDistance, 0, "the tape cannot be read", frame_.size()});
    else if ((status & kSleep) != 0)
      out.push_back({Kind::kNoDistance, 0, "device sleeps", frame_.size()});
    else
      out.push_back({Kind::kDistance, position * unit_m_, "", frame_.size()});
    const int quality = status >> 5U & 3U;  // 0: above 75 %, 3: below 25 %
    if ((status & (kError | kOut | kSleep)) == 0) {
      if (quality == 3)
        out.push_back({Kind::kWarning, 0, "tape is read badly (below 25 %): clean it", 0});
      else if ((status & kDiagnostics) != 0)
        out.push_back({Kind::kWarning, 0, "device has a diagnosis: see its manual", 0});
      else
        out.push_back({Kind::kWell});
    }
  }
}

}  // namespace crane
