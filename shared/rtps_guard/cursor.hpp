// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace crane::guard {

using Bytes = std::span<const std::uint8_t>;

/// Reads numbers of one byte order from bytes that anybody may have written. The caller asks has()
/// before each read; nothing is read beyond the end.
class Cursor {
 public:
  Cursor(Bytes bytes, bool little) : bytes_(bytes), little_(little) {}

  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool has(std::size_t n) const { return left() >= n; }
  [[nodiscard]] bool little() const { return little_; }
  void skip(std::size_t n) { at_ += n; }
  /// To the next multiple of 4, at most to the end.
  void align4() {
    const std::size_t pad = (4 - at_ % 4) % 4;
    at_ += pad < left() ? pad : left();
  }
  Bytes take(std::size_t n) {
    const Bytes out = bytes_.subspan(at_, n);
    at_ += n;
    return out;
  }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return number(4); }
  /// Sequence number: high half first, whatever the byte order. A negative one is larger than any
  /// legal one.
  std::uint64_t sequence() {
    const std::uint64_t high = u32();
    return high << 32U | u32();
  }

 private:
  std::uint32_t number(std::size_t n) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < n; ++i)
      value |= std::uint32_t(bytes_[at_ + i]) << (8 * (little_ ? i : n - 1 - i));
    at_ += n;
    return value;
  }

  Bytes bytes_;
  std::size_t at_ = 0;
  bool little_;
};

}  // namespace crane::guard
