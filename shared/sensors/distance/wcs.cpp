// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/wcs.hpp"

namespace crane {

void WcsProtocol::take(std::span<const std::uint8_t> bytes, DeviceTalk& out) {
  constexpr std::uint8_t kQuestion = 0x80;
  for (const std::uint8_t byte : bytes) {
    if (have_ == 0 && !answered_ && byte == kQuestion) continue;  // our own
    if (answered_) {
      ++damaged_;
      continue;
    }
    frame_[have_++] = byte;
    if (have_ < frame_.size()) continue;
    answered_ = true;
    understand(out);
  }
}

void WcsProtocol::understand(DeviceTalk& out) {
  using Kind = DeviceSaid::Kind;
  constexpr std::uint8_t kError = 1, kOut = 2, kDirty = 4;
  // Flags have three bits, beside those of the address, which is 0; positions 5, 7 and 7.
  const bool fits = (frame_[0] & 0xF8U) == 0 && (frame_[1] & 0xE0U) == 0 &&
                    ((frame_[2] | frame_[3]) & 0x80U) == 0;
  if (!fits || (frame_[0] ^ frame_[1] ^ frame_[2] ^ frame_[3]) != frame_[4]) {
    ++damaged_;
    return;
  }
  const std::uint32_t position =
      std::uint32_t{frame_[1]} << 14U | std::uint32_t{frame_[2]} << 7U | frame_[3];
  if ((frame_[0] & kError) != 0) {
    out.push_back(
        {Kind::kFault, 0, "read head reports error " + std::to_string(position), frame_.size()});
  } else if ((frame_[0] & kOut) != 0) {
    out.push_back(
        {Kind::kNoDistance, 0,
         position == 0 ? "read head is partly off the code rail" : "read head is off the code rail",
         frame_.size()});
  } else {
    out.push_back({Kind::kDistance, position * unit_m_, "", frame_.size()});
    if ((frame_[0] & kDirty) != 0)
      out.push_back({Kind::kWarning, 0, "read head or code rail is dirty: clean it", 0});
    else
      out.push_back({Kind::kWell});
  }
}

}  // namespace crane
