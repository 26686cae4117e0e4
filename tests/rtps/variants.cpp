// SPDX-License-Identifier: Apache-2.0
#include "variants.hpp"

#include <algorithm>

namespace crane::test {
namespace {

constexpr std::size_t kHeader = 20;

std::size_t u16(const Datagram& d, std::size_t at) {
  return at + 2 <= d.size() ? d[at] | std::size_t(d[at + 1]) << 8U : 0;
}

void turn(Datagram& d, std::size_t at, std::size_t bytes) {
  if (at + bytes > d.size()) return;
  std::reverse(d.begin() + std::ptrdiff_t(at), d.begin() + std::ptrdiff_t(at + bytes));
}

std::size_t u32(const Datagram& d, std::size_t at) {
  return u16(d, at) | u16(d, at + 2) << 16U;
}

void turn_words(Datagram& d, std::size_t at, std::size_t bytes) {
  for (std::size_t i = 0; i + 4 <= bytes; i += 4) turn(d, at + i, 4);
}

/// Lengths of so many strings, one behind another. Returns where they end.
std::size_t turn_strings(Datagram& d, std::size_t at, std::size_t count) {
  for (; count > 0 && at + 4 <= d.size(); --count) {
    const std::size_t length = u32(d, at);
    turn(d, at, 4);
    at += 4 + (length + 3) / 4 * 4;
  }
  return at;
}

/// The value of a parameter (DDSI-RTPS 9.6.3).
void turn_value(Datagram& d, std::size_t id, std::size_t at, std::size_t bytes) {
  const std::size_t count = u32(d, at), end = at + bytes;
  switch (id) {
    case 0x15:
    case 0x16:
    case 0x50:
    case 0x52:
    case 0x5A:
    case 0x70:
    case 0x71:
      return;  // octets
    case 0x05:
    case 0x07:
    case 0x62:
      turn_strings(d, at, 1);
      return;
    case 0x29:
      turn(d, at, 4);
      turn_strings(d, at + 4, std::min<std::size_t>(count, 100));
      return;
    case 0x59:
      turn(d, at, 4);
      at = turn_strings(d, at + 4, 2 * std::min<std::size_t>(count, 100));
      if (at + 4 <= end) turn(d, at, 4);  // of binary ones
      return;
    case 0x2F:
    case 0x30:
    case 0x31:
    case 0x32:
    case 0x33:
    case 0x48:
      turn_words(d, at, 8);
      return;
    case 0x73:
      turn(d, at, 4);
      for (std::size_t i = 0; i < count && 4 + 2 * i < bytes; ++i) turn(d, at + 4 + 2 * i, 2);
      return;
    case 0x1001:
    case 0x1002: {
      at = turn_strings(d, at, 1);
      for (int kind = 0; kind < 2; ++kind) {  // properties, binary ones
        const std::size_t n = u32(d, at);
        turn(d, at, 4);
        at = turn_strings(d, at + 4, 2 * std::min<std::size_t>(n, 100));
      }
      return;
    }
    default:
      turn_words(d, at, bytes);
  }
}

/// Returns where the list ends.
std::size_t turn_list(Datagram& d, std::size_t at, std::size_t end) {
  while (at + 4 <= end) {
    const std::size_t id = u16(d, at), length = u16(d, at + 2);
    turn(d, at, 2);
    turn(d, at + 2, 2);
    at += 4;
    if (id == 1 || at + length > end) break;
    turn_value(d, id, at, length);
    at += length;
  }
  return at;
}

void turn_submessage(Datagram& d, std::uint8_t id, std::uint8_t flags, std::size_t at,
                     std::size_t length) {
  switch (id) {
    case 0x06:  // reader, writer; a set of numbers; ...
    case 0x07:
    case 0x08:
    case 0x12:
    case 0x13:
      return turn_words(d, at + 8, length - std::min<std::size_t>(length, 8));
    case 0x09:
      return turn_words(d, at, length);
    case 0x15:
    case 0x16: {
      turn(d, at, 2);
      turn(d, at + 2, 2);
      turn_words(d, at + 12, 8);
      std::size_t behind = at + 20;
      if (id == 0x16) {
        turn(d, behind, 4);
        turn(d, behind + 4, 2);
        turn(d, behind + 6, 2);
        turn(d, behind + 8, 4);
        behind += 12;
      }
      const std::size_t end = at + length;
      if ((flags & 2U) != 0) behind = turn_list(d, behind, end);
      if (id == 0x16 || behind + 4 > end || d[behind] != 0 || d[behind + 1] != 3) return;
      d[behind + 1] = 2;  // PL_CDR_BE
      turn_list(d, behind + 4, end);
      return;
    }
    default:
      return;  // octets
  }
}

void put_before(Datagram& d, const Datagram& submessage) {
  d.insert(d.begin() + kHeader, submessage.begin(), submessage.end());
}

Datagram locators() {
  return Rtps::cat({Rtps::u32(1), Rtps::locator("127.0.0.1", 7411)});
}

}  // namespace

Datagram big_endian(const Datagram& message) {
  Datagram d = message;
  for (std::size_t at = kHeader; at + 4 <= d.size();) {
    const std::uint8_t id = d[at], flags = d[at + 1];
    std::size_t length = u16(d, at + 2);
    const std::size_t left = d.size() - at - 4;
    const bool to_the_end = length == 0 && id != 0x01 && id != 0x09;
    if ((flags & 1U) == 0 || length > left || id == 0x80) break;
    d[at + 1] ^= 1U;
    turn(d, at + 2, 2);
    at += 4;
    if (to_the_end) length = left;
    turn_submessage(d, id, flags, at, length);
    at += length;
  }
  return d;
}

Datagram of_vendor(const Datagram& message, std::uint16_t vendor) {
  Datagram d = message;
  if (d.size() < kHeader) return d;
  const std::uint8_t high = std::uint8_t(vendor >> 8U), low = std::uint8_t(vendor & 255U);
  d[6] = high;
  d[7] = low;
  static constexpr std::uint8_t kVendor[] = {0x16, 0, 4, 0};
  const auto at = std::search(d.begin(), d.end(), std::begin(kVendor), std::end(kVendor));
  if (d.end() - at < 8) return d;
  at[4] = high;
  at[5] = low;
  return d;
}

std::vector<Datagram> variants(const std::vector<Datagram>& messages, std::uint32_t seed) {
  // RTI, OpenDDS, Cyclone DDS, Dust DDS, nobody.
  static constexpr std::uint16_t kVendors[] = {0x0101, 0x0103, 0x0110, 0x0114, 0};
  std::mt19937 random(seed);
  std::vector<Datagram> out;
  for (const Datagram& message : messages) {
    if (message.size() < kHeader) continue;
    Datagram d = message;
    const Datagram prefix(d.begin() + 8, d.begin() + kHeader);
    const Datagram& other = messages[random() % messages.size()];
    const Datagram others =
        other.size() < kHeader ? prefix : Datagram(other.begin() + 8, other.begin() + kHeader);
    if (random() % 2 == 0) d = big_endian(d);
    switch (random() % 7) {
      case 0:
      case 1:
        d = of_vendor(d, kVendors[random() % std::size(kVendors)]);
        break;
      case 2:  // of RTPS 2.0 to 2.5
        d[5] = static_cast<std::uint8_t>(random() % 6);
        break;
      case 3:  // INFO_SRC, as itself or somebody else
        put_before(d, Rtps::cat({{0x0C, 1, 20, 0},
                                 {0, 0, 0, 0, 2, 3, 1, 15},
                                 random() % 2 == 0 ? prefix : others}));
        break;
      case 4:  // INFO_REPLY; INFO_REPLY_IP4
        if (random() % 2 == 0)
          put_before(d, Rtps::cat({{0x0F, 1, 28, 0}, locators()}));
        else
          put_before(d, Rtps::cat({{0x0D, 1, 8, 0}, {127, 0, 0, 1}, Rtps::u32(7411)}));
        break;
      case 5:  // INFO_DST of all, or of somebody else
        put_before(d, Rtps::cat({{0x0E, 1, 12, 0}, random() % 2 == 0 ? Datagram(12, 0) : others}));
        break;
      default:  // PAD, of nothing or something; INFO_TS that takes the time back
        put_before(d, random() % 2 == 0 ? Datagram{0x01, 1, 0, 0, 0x09, 3, 0, 0}
                                        : Datagram{0x01, 1, 4, 0, 0, 0, 0, 0});
    }
    out.push_back(std::move(d));
  }
  return out;
}

}  // namespace crane::test
