// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace crane::guard {

/// Why a datagram was not handed on. Counted by kind.
enum class Refusal : std::uint8_t {
  kNone,
  kHeader,             ///< no RTPS 2 header
  kLength,             ///< a submessage longer than the datagram, or bytes that belong to none
  kUnaligned,          ///< a length that is no multiple of 4, before the last submessage
  kUnknownSubmessage,  ///< a kind that is not on the list
  kStatistics,         ///< Fast DDS's statistics of another size, or not at the end
  kShort,              ///< a submessage shorter than its kind
  kSequenceNumber,     ///< zero, negative, or out of order
  kSet,                ///< a number set of more than 256 bits, or shorter than it says
  kParameter,          ///< a parameter whose size or content does not fit its kind
  kUnknownParameter,   ///< a standard parameter that is not on the list
  kParameterList,      ///< a list without its end
  kUnknownWriter,      ///< a built-in writer that is not on the list, or to another's reader
  kPayload,            ///< a payload of another encoding or size than its writer has
  kToken,              ///< counts or lengths of a security token or handshake that do not fit
  kSecured,            ///< counts or lengths of an encrypted part that do not fit
  kUnprotected,        ///< plain, although such a message is always encrypted
  kBuiltinFragment,    ///< discovery in fragments: cannot be read as a whole
  kFragment,           ///< fragment numbers or sizes that do not fit
  kFragmentsDisagree,  ///< with another fragment of the same sample or writer
  kSampleSize,         ///< a larger sample than the topic has
  kNumberJump,         ///< numbers that would be walked for too long, or held in memory
  kTooManyEndpoints,   ///< of one participant, or new ones at once
  kForeignLocator,     ///< an announcement that only names other hosts' addresses
  kForeignIdentity,    ///< speaks for another participant
  kSpoofedSource,      ///< a known participant from an address that is not its own
  kNewcomers,          ///< too many new participants at once
  kCount
};

/// As it is said to people. Never empty.
std::string_view text(Refusal refusal);

}  // namespace crane::guard
