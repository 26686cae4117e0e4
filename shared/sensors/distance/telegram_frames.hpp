// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace crane {

/// Cuts a stream of characters into telegrams: STX text ETX, or a line ended by CR, LF or both.
class TextFrames {
 public:
  enum class Framing { kStxEtx, kLine };
  struct Frame {
    Framing framing;
    std::string text;       ///< without its ends
    std::size_t bytes = 0;  ///< with them
  };
  /// The telegram that this byte ends. `damaged` grows when one was too long or not of printable
  /// characters.
  std::optional<Frame> take(std::uint8_t byte, std::uint64_t& damaged);
  void forget() { *this = {}; }

 private:
  static constexpr std::size_t kLongest = 96;
  std::string text_;
  bool stx_ = false, bad_ = false;
};

/// "+0012345", "-0012345", " 0012345", "+ 0012345": a sign and exactly `digits` digits, no more.
/// A changed or lost character seldom leaves that many.
std::optional<long> signed_digits(std::string_view text, std::size_t digits);
/// Hexadecimal of at most 8 digits, as 32-bit two's complement.
std::optional<std::int32_t> hex32(std::string_view text);
/// Decimal digits only, at most 9.
std::optional<long> plain_digits(std::string_view text);

}  // namespace crane
