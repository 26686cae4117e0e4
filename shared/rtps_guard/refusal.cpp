// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/refusal.hpp"

namespace crane::guard {

std::string_view text(Refusal refusal) {
  switch (refusal) {
    case Refusal::kNone:
      return "sound";
    case Refusal::kHeader:
      return "no RTPS 2 header";
    case Refusal::kLength:
      return "a submessage longer than the datagram, or bytes behind the last";
    case Refusal::kUnaligned:
      return "a length that is no multiple of 4 before the last submessage";
    case Refusal::kUnknownSubmessage:
      return "an unknown submessage";
    case Refusal::kStatistics:
      return "statistics of another size, or not at the end";
    case Refusal::kShort:
      return "a submessage shorter than its kind";
    case Refusal::kSequenceNumber:
      return "illegal sequence numbers";
    case Refusal::kSet:
      return "a number set that does not fit its number of bits";
    case Refusal::kParameter:
      return "a parameter that does not fit its kind";
    case Refusal::kUnknownParameter:
      return "an unknown standard parameter";
    case Refusal::kParameterList:
      return "a parameter list without its end";
    case Refusal::kUnknownWriter:
      return "an unknown built-in writer, or one to another's reader";
    case Refusal::kPayload:
      return "a payload that does not fit its writer";
    case Refusal::kToken:
      return "a security token or handshake whose counts do not fit";
    case Refusal::kSecured:
      return "an encrypted part whose counts do not fit";
    case Refusal::kUnprotected:
      return "plain, where only encrypted is sent";
    case Refusal::kBuiltinFragment:
      return "discovery in fragments";
    case Refusal::kFragment:
      return "a fragment that does not fit its sample";
    case Refusal::kFragmentsDisagree:
      return "fragments of one sample or writer that do not agree";
    case Refusal::kSampleSize:
      return "a larger sample than its topic has";
    case Refusal::kNumberJump:
      return "a jump of sequence numbers that would be walked too long";
    case Refusal::kTooManyEndpoints:
      return "too many endpoints of one participant, or new ones at once";
    case Refusal::kForeignLocator:
      return "an announcement that names only other hosts' addresses";
    case Refusal::kForeignIdentity:
      return "a participant that speaks for another";
    case Refusal::kSpoofedSource:
      return "a known participant from an address that is not its own";
    case Refusal::kNewcomers:
      return "too many new participants at once";
    case Refusal::kCount:
      break;
  }
  return "unknown";
}

}  // namespace crane::guard
