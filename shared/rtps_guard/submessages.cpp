// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/submessages.hpp"

#include "rtps_guard/builtin.hpp"

namespace crane::guard {

std::uint32_t entity(Bytes id) {
  return std::uint32_t(id[0]) << 24U | std::uint32_t(id[1]) << 16U | std::uint32_t(id[2]) << 8U |
         id[3];
}

bool belong_together(std::uint32_t reader, std::uint32_t writer) {
  if (reader == 0) return true;
  if (!is_builtin(reader) && !is_builtin(writer)) return true;
  const std::uint32_t kind = (writer & 0xFFU) == 0xC3 ? 0xC4 : 0xC7;
  return is_builtin(writer) && reader == ((writer & ~0xFFU) | kind);
}

Refusal set_flaw(Cursor& c) {
  if (!c.has(4)) return Refusal::kSet;
  const std::uint32_t bits = c.u32();
  const std::size_t bytes = (std::size_t{bits} + 31) / 32 * 4;
  if (bits > 256 || !c.has(bytes)) return Refusal::kSet;
  c.skip(bytes);
  return Refusal::kNone;
}

Refusal acknack_flaw(Cursor& c) {
  if (!c.has(16)) return Refusal::kShort;
  c.skip(8);
  if (c.sequence() > kLastNumber) return Refusal::kSequenceNumber;
  if (const Refusal flaw = set_flaw(c); flaw != Refusal::kNone) return flaw;
  return c.has(4) ? Refusal::kNone : Refusal::kShort;
}

Refusal nack_frag_flaw(Cursor& c) {
  if (!c.has(20)) return Refusal::kShort;
  c.skip(8);
  const std::uint64_t number = c.sequence();
  const std::uint32_t first = c.u32();
  if (number == 0 || number > kLastNumber || first == 0 || first > 0xFFFF'0000U)
    return Refusal::kSequenceNumber;
  if (const Refusal flaw = set_flaw(c); flaw != Refusal::kNone) return flaw;
  return c.has(4) ? Refusal::kNone : Refusal::kShort;
}

Refusal heartbeat_frag_flaw(Cursor& c) {
  if (!c.has(24)) return Refusal::kShort;
  c.skip(8);
  const std::uint64_t number = c.sequence();
  const std::uint32_t last = c.u32();
  return number == 0 || number > kLastNumber || last == 0 ? Refusal::kSequenceNumber
                                                          : Refusal::kNone;
}

}  // namespace crane::guard
