// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/benewake.hpp"

#include <algorithm>

namespace crane {

void BenewakeProtocol::take(std::span<const std::uint8_t> bytes, DeviceTalk& out) {
  using Kind = DeviceSaid::Kind;
  constexpr std::uint8_t kHead = 0x59;
  for (const std::uint8_t byte : bytes) {
    frame_[have_++] = byte;
    // Anew from the next byte that may be a beginning.
    const auto seek = [this] {
      std::size_t from = 1;
      while (from < have_ &&
             !(frame_[from] == kHead && (from + 1 == have_ || frame_[from + 1] == kHead)))
        ++from;
      std::copy(frame_.begin() + std::ptrdiff_t(from), frame_.begin() + std::ptrdiff_t(have_),
                frame_.begin());
      have_ -= from;
    };
    if (have_ <= 2 && byte != kHead) {
      ++damaged_;
      have_ = 0;
      continue;
    }
    if (have_ < frame_.size()) continue;
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < 8; ++i) sum += frame_[i];
    if ((sum & 0xFFU) != frame_[8]) {
      ++damaged_;
      seek();
      continue;
    }
    have_ = 0;
    const auto word = [this](std::size_t at) { return frame_[at] | frame_[at + 1] << 8; };
    const int distance = word(2);
    const int strength = word(4);
    constexpr int kTooWeak = 100, kTooStrong = 65'535;
    if (strength < kTooWeak || strength == kTooStrong || distance == 0)
      out.push_back({Kind::kNoDistance, 0,
                     strength < kTooWeak      ? "signal too weak"
                     : strength == kTooStrong ? "signal too strong"
                                              : "reads 0: no target",
                     frame_.size()});
    else
      out.push_back({Kind::kDistance, distance * unit_m_, "", frame_.size()});
    out.push_back({Kind::kFigure, double(strength), "level", 0});
    out.push_back({Kind::kFigure, word(6) / 8.0 - 256, "temperature_c", 0});
  }
}

}  // namespace crane
