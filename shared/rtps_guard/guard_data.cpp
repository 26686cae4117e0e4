// SPDX-License-Identifier: Apache-2.0
// DATA: who announces itself, what it writes, what ends.

#include <algorithm>
#include <utility>

#include "rtps_guard/guard_message.hpp"
#include "rtps_guard/parameters.hpp"

namespace crane::guard {

Refusal Guard::data(const Submessage& s, Message& m) {
  const bool has_qos = (s.flags & 2U) != 0, has_data = (s.flags & 4U) != 0,
             has_key = (s.flags & 8U) != 0;
  Cursor c(s.body, s.little());
  if (!c.has(20)) return Refusal::kShort;
  if (has_data && has_key) return Refusal::kPayload;
  c.skip(2);
  if (c.u16() != 16) return Refusal::kShort;  // to the inline QoS: nothing else in RTPS 2
  const std::uint32_t reader = entity(c.take(4)), writer = entity(c.take(4));
  const std::uint64_t number = c.sequence();
  if (number == 0 || number > kLastNumber) return Refusal::kSequenceNumber;
  if (!belong_together(reader, writer)) return Refusal::kUnknownWriter;
  if (options_.encrypted && !m.decrypted && writer != kParticipants && writer != kHandshake)
    return Refusal::kUnprotected;
  Disposal disposal{false, m.sender.prefix, 0};
  if (has_qos)
    if (const Refusal flaw = inline_qos(c, s.offset, writer, m, disposal); flaw != Refusal::kNone)
      return flaw;
  // Fast DDS takes it for something that goes on, with nothing in it.
  if (has_key && !disposal.disposed) return Refusal::kPayload;
  if (has_data || has_key) {
    if (!c.has(4)) return Refusal::kPayload;
    const std::size_t offset = s.offset + c.at();
    const Bytes bytes = c.take(c.left());
    if (has_data || (is_builtin(writer) && bytes.size() > 16)) {
      const bool again = has_come(reader, writer, number, m);
      if (const Refusal flaw = payload(writer, bytes, offset, again, m, disposal);
          flaw != Refusal::kNone)
        return flaw;
    } else if (is_builtin(writer)) {
      // Fast DDS takes so short a key as it stands.
      if (bytes.size() != 16) return Refusal::kPayload;
      if (const Refusal flaw = check_subject(bytes, m.sender); flaw != Refusal::kNone) return flaw;
      disposal.of(bytes);
    }
  } else if (is_builtin(writer) && !has_qos) {
    return Refusal::kPayload;
  }
  if (const Refusal flaw = sample(reader, writer, number, m); flaw != Refusal::kNone) return flaw;
  return disposal.disposed && !m.elsewhere ? end(s, writer, disposal, m) : Refusal::kNone;
}

Refusal Guard::inline_qos(Cursor& c, std::size_t offset, std::uint32_t writer, Message& m,
                          Disposal& out) {
  const Cursor begin = c;
  ParameterWalk walk(c);
  bool has_key_hash = false;
  for (Parameter p; walk.next(p);) {
    if (p.id == kPidStatusInfo && p.value[3] >= 1 && p.value[3] <= 3) out.disposed = true;
    if (p.id != kPidKeyHash) continue;
    has_key_hash = true;
    if (!is_builtin(writer)) continue;
    if (const Refusal flaw = check_subject(p.value, m.sender); flaw != Refusal::kNone) return flaw;
    out.of(p.value);
  }
  if (walk.refusal() != Refusal::kNone || !has_key_hash || is_builtin(writer) || out.disposed)
    return walk.refusal();
  // Fast DDS believes it whatever the sample says, and has room for a few instances only: what
  // lives is to be told apart by what is in it. (Nobody sends a hash who is not asked to.)
  Cursor again = begin;
  ParameterWalk hashes(again);
  for (Parameter p; hashes.next(p);)
    if (p.id == kPidKeyHash) m.patches.zero16(offset + p.offset);
  return Refusal::kNone;
}

/// Fast DDS may forget the endpoint that it is told of, and begin anew should it come back; or it
/// may not, as the message was old to it. So its numbers count again.
Refusal Guard::end(const Submessage& s, std::uint32_t writer, const Disposal& disposal,
                   Message& m) {
  Participant* who = participants_.find(disposal.subject, m.now);
  if (announces_participants(writer) && !m.sender.relay) {
    // Told of the end of a participant at the moment when its lease ends, Fast DDS ends by an
    // assertion (PDP::check_remote_participant_liveliness). Its endpoints say their ends; it
    // itself goes with its lease.
    if (s.to_the_end) return Refusal::kPayload;  // padding has to say how much
    m.patches.skip_submessage(s.offset - 4);
  } else if (announces_participants(writer)) {
    if (who == nullptr) return Refusal::kNone;
    forget_numbers(*who, 0);
    who->lapse();
  } else if (announces_endpoints(writer) && who != nullptr) {
    forget_numbers(*who, disposal.entity);
    who->forget_endpoint(disposal.entity);
  }
  return Refusal::kNone;
}

/// Of one writer, or of all (0).
void Guard::forget_numbers(Participant& participant, std::uint32_t writer) {
  std::erase_if(participant.numbers, [&](const auto& known) {
    if (writer != 0 && known.first.second != writer) return false;
    budget_.held -= std::min(budget_.held, known.second.held());
    return true;
  });
}

Refusal Guard::payload(std::uint32_t writer, Bytes bytes, std::size_t offset, bool again,
                       Message& m, Disposal& disposal) {
  if (!is_builtin(writer)) return Refusal::kNone;
  Announcement announced;
  const BuiltinContext context{m.sender, own_, options_.domain};
  const Refusal flaw = read_builtin(writer, bytes, offset, context, announced, m.patches);
  if (flaw != Refusal::kNone) return flaw;
  if (m.elsewhere) return Refusal::kNone;
  if (!disposal.disposed) return remember(writer, announced, again, m);
  disposal.subject = announced.subject;
  if (disposal.entity == 0) disposal.entity = announced.entity;  // Fast DDS goes by the hash
  return Refusal::kNone;
}

/// `again`: a number that has come already, which Fast DDS does not read twice.
Refusal Guard::remember(std::uint32_t writer, const Announcement& announced, bool again,
                        Message& m) {
  if (announces_participants(writer)) {
    const bool known = participants_.find(announced.subject, m.now) != nullptr;
    Participant* who = participants_.announce(announced.subject, m.sender.origin, m.now);
    if (who == nullptr) return Refusal::kNewcomers;
    const bool itself = announced.subject == m.sender.prefix;
    if (!known) {
      who->addresses = announced.addresses;
      if (itself) who->addresses.push_back(m.source);
      who->this_host = m.sender.origin.this_host;
    }
    who->lease = std::chrono::seconds(announced.lease_seconds);
    if (itself) m.participant = who;
  } else if (announces_endpoints(writer) && announced.entity != 0) {
    Participant* who = participants_.find(announced.subject, m.now);
    if (who == nullptr || is_builtin(announced.entity)) return Refusal::kNone;
    // What it says anew of a known one may let it match anew, and it is sent everything again.
    const bool known = who->has_announced(announced.entity);
    if (!(known && again) && !participants_.admit_endpoint(*who, known, m.now))
      return Refusal::kTooManyEndpoints;
    // Whatever it sent before was to no reader of ours.
    if (!known) forget_numbers(*who, announced.entity);
    if (writer != kPublications && writer != kSecurePublications) {
      who->readers.insert(announced.entity);
      return Refusal::kNone;
    }
    Writer& announced_writer = who->writers[announced.entity];
    announced_writer.announced = true;
    if (options_.largest_sample)
      announced_writer.largest_sample = options_.largest_sample(announced.topic);
  }
  return Refusal::kNone;
}

}  // namespace crane::guard
