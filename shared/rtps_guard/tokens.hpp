// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rtps_guard/cursor.hpp"
#include "rtps_guard/message.hpp"
#include "rtps_guard/refusal.hpp"

namespace crane::guard {

/// Length, characters, zero, padding. False if it does not fit.
bool read_string(Cursor& c);
/// DDS Security's DataHolder (7.2.3): a class, properties, binary properties. Fast DDS makes room
/// for as many as it claims before it reads them.
bool read_data_holder(Cursor& c);
/// ParticipantGenericMessage (DDS Security 7.2.5) behind its encoding: what the handshake is made
/// of.
Refusal generic_message_flaw(Cursor& c, const Prefix& source);

/// Headers and counts of encrypted parts: 20 bytes, a body within its submessage, 20 bytes for each
/// receiver.
bool secured_prefix_fits(Bytes body);
bool secured_body_fits(Bytes body);
bool secured_postfix_fits(Bytes body);

}  // namespace crane::guard
