// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/builtin.hpp"

#include <algorithm>
#include <utility>

#include "rtps_guard/parameters.hpp"
#include "rtps_guard/tokens.hpp"

namespace crane::guard {
namespace {

/// Fast DDS looks up a newcomer's readers and writers without the lock that keeps it from being
/// forgotten meanwhile.
constexpr std::uint32_t kShortestLeaseSeconds = 1, kLongestLeaseSeconds = 60;
constexpr std::size_t kMostLocators = 32;

/// PL_CDR in either byte order; nothing else is discovery.
bool is_parameter_list(Bytes encoding) {
  return encoding[0] == 0 && (encoding[1] == 2 || encoding[1] == 3);
}

bool is_plain(Bytes encoding) {
  return encoding[0] == 0 && encoding[1] <= 1;
}

class ListReader {
 public:
  ListReader(std::size_t offset, bool little, const BuiltinContext& context, Announcement& out,
             Patches& patches)
      : offset_(offset), little_(little), context_(context), out_(out), patches_(patches) {}

  Refusal read(const Parameter& p) {
    switch (p.id) {
      case kPidParticipantGuid:
      case kPidEndpointGuid:
      case kPidKeyHash:
        return subject(p);
      case kPidTopicName:
        out_.topic = string_of(p, little_);
        return Refusal::kNone;
      case kPidLease:
        return lease(p);
      case kPidUnicastLocator:
      case kPidMulticastLocator:
      case kPidDefaultUnicast:
      case kPidDefaultMulticast:
      case kPidMetatrafficUnicast:
      case kPidMetatrafficMulticast:
        return locator(p);
      case kPidDataSharing:
        if (context_.sender.origin.address != 0 && !context_.sender.origin.this_host) take_out(p);
        return Refusal::kNone;
      case kPidContentFilter:
      case kPidTypeId:
      case kPidTypeObject:
      case kPidTypeInformation:
        take_out(p);
        return Refusal::kNone;
      default:
        return Refusal::kNone;
    }
  }

 private:
  void take_out(const Parameter& p) { patches_.zero16(offset_ + p.offset); }  // becomes padding

  Refusal subject(const Parameter& p) {
    const Refusal flaw = check_subject(p.value, context_.sender);
    if (flaw != Refusal::kNone) return flaw;
    Prefix named{};
    std::copy_n(p.value.begin(), named.size(), named.begin());
    if (std::exchange(named_, true) && named != out_.subject) return Refusal::kForeignIdentity;
    out_.subject = named;
    if (p.id == kPidEndpointGuid || p.id == kPidKeyHash) {
      Cursor c(p.value.subspan(12), false);
      out_.entity = c.u32();
    }
    return Refusal::kNone;
  }

  Refusal lease(const Parameter& p) {
    Cursor c(p.value, little_);
    const std::uint32_t seconds = c.u32();
    out_.lease_seconds = std::clamp(seconds, kShortestLeaseSeconds, kLongestLeaseSeconds);
    if (seconds != out_.lease_seconds || seconds == kLongestLeaseSeconds) {
      patches_.put32(offset_ + p.offset + 4, out_.lease_seconds, little_);
      patches_.put32(offset_ + p.offset + 8, 0, little_);
    }
    return Refusal::kNone;
  }

  Refusal locator(const Parameter& p) {
    if (++locators_ > kMostLocators) return Refusal::kParameterList;
    const Sender& sender = context_.sender;
    const Locator at(p.value, little_);
    if (sender.origin.address == 0) return Refusal::kNone;
    if (is_group(at, context_.domain)) return Refusal::kNone;
    const bool unicast = at.kind == Locator::kUdp4 && !at.multicast() && at.address != 0;
    if (unicast) {
      out_.named_any_address = true;
      if (out_.addresses.size() < 8) out_.addresses.push_back(at.address);
    }
    // A discovery server vouches for the addresses of others.
    const bool own = is_senders_own(at, sender.origin, context_.own) ||
                     (sender.relay && unicast && at.port != 0);
    if (own && unicast) out_.named_own_address = true;
    if (!own) take_out(p);
    return Refusal::kNone;
  }

  std::size_t offset_;
  bool little_;
  const BuiltinContext& context_;
  Announcement& out_;
  Patches& patches_;
  bool named_ = false;
  std::size_t locators_ = 0;
};

Refusal read_list(Bytes payload, std::size_t offset, const BuiltinContext& context,
                  Announcement& out, Patches& patches) {
  if (!is_parameter_list(payload)) return Refusal::kPayload;
  const bool little = payload[1] == 3;
  Cursor c(payload.subspan(4), little);
  ParameterWalk walk(c);
  ListReader reader(offset + 4, little, context, out, patches);
  for (Parameter p; walk.next(p);)
    if (const Refusal flaw = reader.read(p); flaw != Refusal::kNone) return flaw;
  return walk.refusal();
}

/// ParticipantMessageData (DDSI-RTPS 8.4.13.5): who, kind, octets.
Refusal read_liveliness(Bytes payload, const Sender& sender) {
  if (payload[0] != 0 || payload[1] > 3) return Refusal::kPayload;
  Cursor c(payload.subspan(4), payload[1] % 2 == 1);
  if (!c.has(20)) return Refusal::kPayload;
  const Prefix& who = sender.prefix;
  if (!std::equal(who.begin(), who.end(), c.take(12).begin())) return Refusal::kForeignIdentity;
  c.skip(4);
  return c.u32() <= c.left() ? Refusal::kNone : Refusal::kPayload;
}

}  // namespace

Refusal check_subject(Bytes guid, const Sender& sender) {
  return sender.relay || std::equal(sender.prefix.begin(), sender.prefix.end(), guid.begin())
             ? Refusal::kNone
             : Refusal::kForeignIdentity;
}

Refusal read_builtin(std::uint32_t writer, Bytes payload, std::size_t offset,
                     const BuiltinContext& context, Announcement& out, Patches& patches) {
  if (payload.size() < 4) return Refusal::kPayload;
  out.subject = context.sender.prefix;
  switch (writer) {
    case kParticipants:
    case kSecureParticipants: {
      const Refusal flaw = read_list(payload, offset, context, out, patches);
      if (flaw != Refusal::kNone) return flaw;
      return out.named_any_address && !out.named_own_address ? Refusal::kForeignLocator
                                                             : Refusal::kNone;
    }
    case kTopics:
    case kPublications:
    case kSubscriptions:
    case kSecurePublications:
    case kSecureSubscriptions:
      return read_list(payload, offset, context, out, patches);
    case kLiveliness:
    case kSecureLiveliness:
      return read_liveliness(payload, context.sender);
    case kHandshake: {
      if (!is_plain(payload)) return Refusal::kPayload;
      Cursor c(payload.subspan(4), payload[1] == 1);
      return generic_message_flaw(c, context.sender.prefix);
    }
    case kKeyExchange:
      return Refusal::kUnprotected;
    default:
      return Refusal::kUnknownWriter;
  }
}

}  // namespace crane::guard
