// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/tokens.hpp"

#include <algorithm>

namespace crane::guard {
namespace {

/// Real tokens have three properties, real handshakes eight.
constexpr std::uint32_t kMostProperties = 64, kMostHolders = 16;

bool read_octets(Cursor& c) {
  if (!c.has(4)) return false;
  const std::uint32_t length = c.u32();
  if (!c.has(length)) return false;
  c.skip(length);
  c.align4();
  return true;
}

/// A count of entries that take at least so many bytes each.
bool read_count(Cursor& c, std::uint32_t most, std::size_t least_bytes, std::uint32_t& out) {
  if (!c.has(4)) return false;
  out = c.u32();
  return out <= most && out <= c.left() / least_bytes;
}

}  // namespace

bool read_string(Cursor& c) {
  if (!c.has(4)) return false;
  const std::uint32_t length = c.u32();
  if (length == 0 || !c.has(length)) return false;
  const Bytes characters = c.take(length);
  c.align4();
  return characters[length - 1] == 0;
}

bool read_data_holder(Cursor& c) {
  std::uint32_t count = 0;
  if (!read_string(c) || !read_count(c, kMostProperties, 10, count)) return false;
  for (; count > 0; --count)
    if (!read_string(c) || !read_string(c)) return false;
  if (!read_count(c, kMostProperties, 9, count)) return false;
  for (; count > 0; --count)
    if (!read_string(c) || !read_octets(c)) return false;
  return true;
}

Refusal generic_message_flaw(Cursor& c, const Prefix& source) {
  // Two message identities (GUID, number), three GUIDs.
  if (!c.has(24 + 24 + 48)) return Refusal::kToken;
  const Bytes from = c.take(12);
  if (!std::equal(from.begin(), from.end(), source.begin())) return Refusal::kForeignIdentity;
  c.skip(12 + 24 + 48);
  std::uint32_t count = 0;
  if (!read_string(c) || !read_count(c, kMostHolders, 13, count)) return Refusal::kToken;
  for (; count > 0; --count)
    if (!read_data_holder(c)) return Refusal::kToken;
  return c.left() < 4 ? Refusal::kNone : Refusal::kToken;
}

bool secured_prefix_fits(Bytes body) {
  // Kind of transformation, key, session, vector.
  return body.size() == 20 && body[0] == 0 && body[1] == 0 && body[2] == 0 && body[3] <= 4;
}

bool secured_body_fits(Bytes body) {
  Cursor c(body, false);  // its length is big-endian, whatever the flag
  return c.has(4) && c.has(c.u32());
}

bool secured_postfix_fits(Bytes body) {
  Cursor c(body, false);
  if (!c.has(20)) return false;
  c.skip(16);
  const std::uint32_t receivers = c.u32();
  return receivers <= c.left() / 20 && c.left() == std::size_t{receivers} * 20;
}

}  // namespace crane::guard
