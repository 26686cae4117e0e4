// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace crane::guard {

/// Bytes of a datagram that are handed on otherwise than they came.
class Patches {
 public:
  void clear() { all_.clear(); }
  [[nodiscard]] bool empty() const { return all_.empty(); }
  /// A submessage whose header is there becomes padding, of the same length.
  void skip_submessage(std::size_t header) { all_.push_back({header, 1, {1}}); }
  /// Two bytes of any value, or a number of 4 or 8 bytes.
  void zero16(std::size_t at) { all_.push_back({at, 2, {}}); }
  void put32(std::size_t at, std::uint32_t value, bool little) {
    Patch p{at, 4, {}};
    for (unsigned i = 0; i < 4; ++i)
      p.bytes[i] = static_cast<std::uint8_t>(value >> (8 * (little ? i : 3 - i)));
    all_.push_back(p);
  }
  void put_sequence(std::size_t at, std::uint64_t value, bool little) {
    put32(at, static_cast<std::uint32_t>(value >> 32U), little);
    put32(at + 4, static_cast<std::uint32_t>(value), little);
  }
  void apply(std::span<std::uint8_t> datagram) const {
    for (const Patch& p : all_)
      std::copy_n(p.bytes.begin(), p.size, datagram.begin() + std::ptrdiff_t(p.at));
  }

 private:
  struct Patch {
    std::size_t at;
    std::size_t size;
    std::array<std::uint8_t, 4> bytes;
  };
  std::vector<Patch> all_;
};

}  // namespace crane::guard
