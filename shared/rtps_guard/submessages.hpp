// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rtps_guard/cursor.hpp"
#include "rtps_guard/refusal.hpp"

namespace crane::guard {

/// The highest number that anybody may have: far beyond what is ever written, far below where
/// arithmetic with it overflows.
constexpr std::uint64_t kLastNumber = 1ULL << 62U;

/// Of 4 bytes, as they stand.
std::uint32_t entity(Bytes id);
/// A built-in reader listens to its own writer only, and the other way round.
bool belong_together(std::uint32_t reader, std::uint32_t writer);

/// Number of bits, bitmap.
Refusal set_flaw(Cursor& c);
// Submessages that only writers read: nothing of them is followed, so they must fit, no more.
Refusal acknack_flaw(Cursor& c);
Refusal nack_frag_flaw(Cursor& c);
Refusal heartbeat_frag_flaw(Cursor& c);

}  // namespace crane::guard
