// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/text_line.hpp"

#include <charconv>
#include <cmath>

namespace crane {
namespace {

/// The only number of a line.
std::optional<double> only_number(std::string_view text) {
  std::optional<double> found;
  for (std::size_t i = 0; i < text.size();) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (!digit) {
      ++i;
      continue;
    }
    std::size_t from = i;
    const bool negative = from > 0 && text[from - 1] == '-';
    double value = 0;
    const auto [end, failed] = std::from_chars(text.data() + from, text.data() + text.size(), value,
                                               std::chars_format::fixed);
    if (failed != std::errc() || found || !std::isfinite(value)) return std::nullopt;
    found = negative ? -value : value;
    i = static_cast<std::size_t>(end - text.data());
  }
  return found;
}

/// 9999.9: what devices say when they have nothing to say.
bool all_nines(std::string_view text) {
  std::size_t nines = 0;
  for (const char c : text) {
    if (c >= '0' && c <= '8') return false;
    nines += c == '9' ? 1 : 0;
  }
  return nines >= 4;
}

}  // namespace

void TextLineProtocol::take(std::span<const std::uint8_t> bytes, DeviceTalk& out) {
  using Kind = DeviceSaid::Kind;
  for (const std::uint8_t byte : bytes) {
    const auto frame = frames_.take(byte, damaged_);
    if (!frame) continue;
    const auto number = only_number(frame->text);
    if (!number)
      ++damaged_;
    else if (*number == 0 || all_nines(frame->text))
      out.push_back({Kind::kNoDistance, 0, "reads '" + frame->text + "': no target", frame->bytes});
    else
      out.push_back({Kind::kDistance, *number * unit_m_, "", frame->bytes});
  }
}

}  // namespace crane
