// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/telegram_frames.hpp"

#include <charconv>

namespace crane {
namespace {

constexpr std::uint8_t kStx = 2, kEtx = 3;

bool all_digits(std::string_view text) {
  for (const char c : text)
    if (c < '0' || c > '9') return false;
  return !text.empty();
}

}  // namespace

std::optional<TextFrames::Frame> TextFrames::take(std::uint8_t byte, std::uint64_t& damaged) {
  const auto start_anew = [&](bool stx) {
    text_.clear();
    stx_ = stx;
    bad_ = false;
  };
  if (byte == kStx) {
    if (stx_ || !text_.empty()) ++damaged;  // the one before has no end
    start_anew(true);
    return std::nullopt;
  }
  const bool line_end = byte == '\r' || byte == '\n';
  if (byte == kEtx ? stx_ : line_end && !stx_) {
    const Framing framing = stx_ ? Framing::kStxEtx : Framing::kLine;
    const bool bad = bad_;
    std::string text = std::move(text_);
    start_anew(false);
    if (bad) ++damaged;
    if (bad || (framing == Framing::kLine && text.empty())) return std::nullopt;
    const std::size_t ends = framing == Framing::kStxEtx ? 2 : 1;
    const std::size_t bytes = text.size() + ends;
    return Frame{framing, std::move(text), bytes};
  }
  if (line_end && stx_) {  // STX was no beginning, or its end was lost
    ++damaged;
    start_anew(false);
    return std::nullopt;
  }
  if (byte == kEtx || byte < 0x20 || byte > 0x7E || text_.size() >= kLongest) {
    bad_ = true;
    if (text_.size() >= kLongest) {  // nothing ends it: look for the next beginning
      ++damaged;
      start_anew(false);
    }
    return std::nullopt;
  }
  text_ += static_cast<char>(byte);
  return std::nullopt;
}

std::optional<long> signed_digits(std::string_view text, std::size_t digits) {
  if (text.empty() || (text[0] != '+' && text[0] != '-' && text[0] != ' ')) return std::nullopt;
  const bool negative = text[0] == '-';
  text.remove_prefix(1);
  if (!text.empty() && text[0] == ' ') text.remove_prefix(1);
  if (text.size() != digits) return std::nullopt;
  const auto value = plain_digits(text);
  if (!value) return std::nullopt;
  return negative ? -*value : *value;
}

std::optional<std::int32_t> hex32(std::string_view text) {
  std::uint32_t value = 0;
  if (text.empty() || text.size() > 8) return std::nullopt;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (failed != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return static_cast<std::int32_t>(value);
}

std::optional<long> plain_digits(std::string_view text) {
  if (text.size() > 9 || !all_digits(text)) return std::nullopt;
  long value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace crane
