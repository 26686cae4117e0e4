// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/dimetix.hpp"

namespace crane {
namespace {

/// Of the errors in the manuals' FAQ; all others keep their number.
const char* meaning(long error) {
  switch (error) {
    case 203:
      return "does not know the command";
    case 252:
      return "too hot";
    case 253:
      return "too cold";
    case 254:
      return "supply voltage too low";
    case 255:
      return "signal too weak";
    case 256:
      return "signal too strong";
    default:
      return "see its manual";
  }
}

}  // namespace

void DimetixProtocol::take(std::span<const std::uint8_t> bytes, DeviceTalk& out) {
  for (const std::uint8_t byte : bytes) {
    const auto frame = frames_.take(byte, damaged_);
    if (frame && !understand(*frame, out)) ++damaged_;
  }
}

bool DimetixProtocol::understand(const TextFrames::Frame& frame, DeviceTalk& out) const {
  using Kind = DeviceSaid::Kind;
  const std::string_view text = frame.text;
  if (text == "g0?") return true;  // it has stopped, or has just been switched on
  if (text.starts_with("g0@E")) {
    const auto error = plain_digits(text.substr(4));
    if (!error) return false;
    const bool no_target = *error == 255 || *error == 256;
    out.push_back({no_target ? Kind::kNoDistance : Kind::kFault, 0,
                   "error E" + std::to_string(*error) + ": " + meaning(*error), frame.bytes + 1});
    return true;
  }
  if (text.size() != 12 || !(text.starts_with("g0h") || text.starts_with("g0g"))) return false;
  const auto counts = signed_digits(text.substr(3), 8);
  if (!counts) return false;
  if (*counts == 0)
    out.push_back({Kind::kNoDistance, 0, "reads 0: no target", frame.bytes + 1});
  else
    out.push_back({Kind::kDistance, double(*counts) * unit_m_, "", frame.bytes + 1});
  return true;
}

}  // namespace crane
