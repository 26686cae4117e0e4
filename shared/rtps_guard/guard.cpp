#include "rtps_guard/guard.hpp"

#include <algorithm>
#include <utility>

#include "rtps_guard/parameters.hpp"
#include "rtps_guard/tokens.hpp"

namespace crane::guard {
namespace {

constexpr std::uint64_t kLastNumber = 1ULL << 62U;
/// The largest sample that any topic carries, and what its encoding adds.
constexpr std::uint32_t kLargestSample = (40U << 20U) + 65'536;
constexpr std::size_t kFragmentedSamples = 65'536;

/// 44.53.<id>.5f.45.50.52.4f.53.49.4d.41: 'fastdds discovery'.
bool is_server(const Prefix& p) {
  static constexpr Prefix kServer = {0x44, 0x53, 0,    0x5f, 0x45, 0x50,
                                     0x52, 0x4f, 0x53, 0x49, 0x4d, 0x41};
  return p[0] == kServer[0] && p[1] == kServer[1] &&
         std::equal(p.begin() + 3, p.end(), kServer.begin() + 3);
}

std::uint32_t entity(Bytes id) {
  return std::uint32_t(id[0]) << 24U | std::uint32_t(id[1]) << 16U | std::uint32_t(id[2]) << 8U |
         id[3];
}

/// A built-in reader listens to its own writer only, and the other way round.
bool belong_together(std::uint32_t reader, std::uint32_t writer) {
  if (reader == 0) return true;
  if (!is_builtin(reader) && !is_builtin(writer)) return true;
  const std::uint32_t kind = (writer & 0xFFU) == 0xC3 ? 0xC4 : 0xC7;
  return is_builtin(writer) && reader == ((writer & ~0xFFU) | kind);
}

/// Number of bits, bitmap.
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

}  // namespace

struct Guard::Message {
  Ipv4 source = 0;
  Clock::time_point now;
  Sender sender;
  Participant* participant = nullptr;
  std::uint16_t vendor = 0;
  bool elsewhere = false;  ///< INFO_DST: for another participant
  bool decrypted = false;  ///< within a signed part: made by an authenticated peer
  Patches& patches;
};

struct Guard::Disposal {
  bool disposed = false;
  Prefix subject{};
  std::uint32_t entity = 0;

  void of(Bytes guid) {
    std::copy_n(guid.begin(), subject.size(), subject.begin());
    entity = guard::entity(guid.subspan(12));
  }
};

void Guard::set_own_addresses(std::vector<Ipv4> addresses) {
  const std::lock_guard lock(mutex_);
  own_.set(std::move(addresses));
}

void Guard::set_self(const Prefix& self) {
  const std::lock_guard lock(mutex_);
  self_ = self;
}

void Guard::check(Bytes datagram, Ipv4 source, Clock::time_point now, Verdict& out) {
  out.patches.clear();
  const std::lock_guard lock(mutex_);
  budget_.held -= std::min(budget_.held, participants_.take_released());
  Message m{source, now, {}, nullptr, 0, false, false, out.patches};
  m.sender.origin = {source, source == 0 || own_.has(source)};
  out.refusal = message(datagram, m);
}

Refusal Guard::message(Bytes datagram, Message& m) {
  MessageWalk walk(datagram);
  if (walk.refusal() != Refusal::kNone) return walk.refusal();
  m.vendor = walk.header().vendor;
  if (const Refusal flaw = change_source(walk.header().prefix, m); flaw != Refusal::kNone)
    return flaw;
  Submessage s;
  for (bool first = true; walk.next(s); first = false) {
    Refusal flaw = Refusal::kNone;
    if (s.id == kSecPrefix || (s.id == kSrtpsPrefix && first))
      flaw = secured(walk, s, m);
    else
      flaw = submessage(s, m);
    if (flaw != Refusal::kNone) return flaw;
  }
  return walk.refusal();
}

Refusal Guard::change_source(const Prefix& prefix, Message& m) {
  m.sender.prefix = prefix;
  m.sender.relay = options_.servers && is_server(prefix);
  m.participant = participants_.find(prefix, m.now);
  if (m.participant == nullptr) return Refusal::kNone;
  if (!m.sender.relay && !m.participant->lives_at(m.sender.origin)) return Refusal::kSpoofedSource;
  // Whatever it says keeps it alive. Else Fast DDS has forgotten its writers and begins anew.
  if (m.now - m.participant->heard > m.participant->lease) forget_numbers(*m.participant, 0);
  m.participant->heard = m.now;
  return Refusal::kNone;
}

/// From its prefix to its postfix: an encrypted body, or signed submessages as they are.
Refusal Guard::secured(MessageWalk& walk, const Submessage& prefix, Message& m) {
  if (!secured_prefix_fits(prefix.body)) return Refusal::kSecured;
  const bool whole = prefix.id == kSrtpsPrefix;
  const std::uint8_t end = whole ? kSrtpsPostfix : kSecPostfix;
  m.decrypted = true;
  Submessage s;
  std::size_t parts = 0;
  for (; walk.next(s) && s.id != end; ++parts) {
    if (s.id == kSecBody) {
      if (parts > 0 || !secured_body_fits(s.body)) return Refusal::kSecured;
      continue;
    }
    if (!whole && parts > 0) return Refusal::kSecured;
    const Refusal flaw = whole && s.id == kSecPrefix ? secured(walk, s, m) : submessage(s, m);
    m.decrypted = true;
    if (flaw != Refusal::kNone) return flaw;
  }
  if (walk.refusal() != Refusal::kNone) return walk.refusal();
  if (parts == 0 || s.id != end || !secured_postfix_fits(s.body)) return Refusal::kSecured;
  m.decrypted = false;
  return Refusal::kNone;
}

Refusal Guard::submessage(const Submessage& s, Message& m) {
  Cursor c(s.body, s.little());
  const bool plain_only = options_.encrypted && !m.decrypted;
  switch (s.id) {
    case kPad:
      return Refusal::kNone;
    case kInfoTs:
      return (s.flags & 2U) != 0 || s.body.size() >= 8 ? Refusal::kNone : Refusal::kShort;
    case kInfoSrc: {
      if (s.body.size() != 20) return Refusal::kShort;
      Prefix prefix{};
      std::copy_n(s.body.begin() + 8, prefix.size(), prefix.begin());
      return change_source(prefix, m);
    }
    case kInfoDst: {
      if (s.body.size() < 12) return Refusal::kShort;
      Prefix to{};
      std::copy_n(s.body.begin(), to.size(), to.begin());
      if (to != Prefix{}) m.elsewhere = self_ != Prefix{} && to != self_;
      return Refusal::kNone;
    }
    case kData:
      return data(s, m);
    case kAckNack:
      return plain_only ? Refusal::kUnprotected : acknack_flaw(c);
    case kNackFrag:
      return plain_only ? Refusal::kUnprotected : nack_frag_flaw(c);
    case kHeartbeat:
      return plain_only ? Refusal::kUnprotected : heartbeat(s, m);
    case kGap:
      return plain_only ? Refusal::kUnprotected : gap(s, m);
    case kDataFrag:
      return plain_only ? Refusal::kUnprotected : data_frag(s, m);
    case kHeartbeatFrag:
      return s.body.size() >= 24 ? Refusal::kNone : Refusal::kShort;
    default: {
      constexpr std::uint16_t kEprosima = 0x010F;
      // Statistics were measured by the walk. What other vendors add is skipped by all.
      const bool skipped = s.id == kVendorFirst || (s.id > kVendorFirst && m.vendor != kEprosima);
      return skipped ? Refusal::kNone : Refusal::kUnknownSubmessage;
    }
  }
}

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
  Disposal disposal{has_key, m.sender.prefix, 0};
  if (has_qos)
    if (const Refusal flaw = inline_qos(c, writer, m, disposal); flaw != Refusal::kNone)
      return flaw;
  if (has_data || has_key) {
    if (!c.has(4)) return Refusal::kPayload;
    const std::size_t offset = s.offset + c.at();
    const Bytes bytes = c.take(c.left());
    if (has_data || (is_builtin(writer) && bytes.size() > 16)) {
      if (const Refusal flaw = payload(writer, bytes, offset, m, disposal); flaw != Refusal::kNone)
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
  NumberTrack* numbers = nullptr;
  std::uint64_t low = 0;
  if (const Refusal flaw = numbers_of(reader, writer, m, numbers, low); flaw != Refusal::kNone)
    return flaw;
  if (numbers != nullptr) track(*numbers, number, number + 1);
  if (disposal.disposed && !m.elsewhere) dispose(writer, disposal, m);
  return Refusal::kNone;
}

Refusal Guard::inline_qos(Cursor& c, std::uint32_t writer, Message& m, Disposal& out) {
  ParameterWalk walk(c);
  for (Parameter p; walk.next(p);) {
    if (p.id == kPidStatusInfo && p.value[3] != 0) out.disposed = true;
    if (p.id != kPidKeyHash || !is_builtin(writer)) continue;
    if (const Refusal flaw = check_subject(p.value, m.sender); flaw != Refusal::kNone) return flaw;
    out.of(p.value);
  }
  return walk.refusal();
}

/// Fast DDS may forget whom it is told of, and begin anew should it come back; or it may not, as
/// the message was old to it. So the participant stays known, and its numbers count again.
void Guard::dispose(std::uint32_t writer, const Disposal& disposal, Message& m) {
  const bool all = announces_participants(writer);
  if (!all && !announces_endpoints(writer)) return;
  Participant* who = participants_.find(disposal.subject, m.now);
  if (who != nullptr) forget_numbers(*who, all ? 0 : disposal.entity);
}

/// Of one writer, or of all (0).
void Guard::forget_numbers(Participant& participant, std::uint32_t writer) {
  std::erase_if(participant.numbers, [&](const auto& known) {
    if (writer != 0 && known.first.second != writer) return false;
    budget_.held -= std::min(budget_.held, known.second.held());
    return true;
  });
}

Refusal Guard::payload(std::uint32_t writer, Bytes bytes, std::size_t offset, Message& m,
                       Disposal& disposal) {
  if (!is_builtin(writer)) return Refusal::kNone;
  Announcement announced;
  const BuiltinContext context{m.sender, own_, options_.domain};
  const Refusal flaw = read_builtin(writer, bytes, offset, context, announced, m.patches);
  if (flaw != Refusal::kNone) return flaw;
  if (m.elsewhere) return Refusal::kNone;
  if (!disposal.disposed) return remember(writer, announced, m);
  disposal.subject = announced.subject;
  disposal.entity = announced.entity;
  return Refusal::kNone;
}

Refusal Guard::remember(std::uint32_t writer, const Announcement& announced, Message& m) {
  if (announces_participants(writer)) {
    const bool known = participants_.find(announced.subject, m.now) != nullptr;
    Participant* who = participants_.announce(announced.subject, m.now);
    if (who == nullptr) return Refusal::kNewcomers;
    const bool itself = announced.subject == m.sender.prefix;
    if (!known) {
      who->addresses = announced.addresses;
      if (itself) who->addresses.push_back(m.source);
      who->this_host = m.sender.origin.this_host;
    }
    who->lease = std::chrono::seconds(announced.lease_seconds);
    if (itself) m.participant = who;
  } else if (announces_endpoints(writer) && !announced.topic.empty()) {
    Participant* who = participants_.find(announced.subject, m.now);
    if (who == nullptr || is_builtin(announced.entity)) return Refusal::kNone;
    if (writer != kPublications && writer != kSecurePublications) return Refusal::kNone;
    if (who->writers.size() >= Participants::kWritersOfOne &&
        !who->writers.contains(announced.entity))
      return Refusal::kTooManyWriters;
    Writer& announced_writer = who->writers[announced.entity];
    // Whatever it sent before was to no reader of ours.
    if (!std::exchange(announced_writer.announced, true)) forget_numbers(*who, announced.entity);
    if (options_.largest_sample)
      announced_writer.largest_sample = options_.largest_sample(announced.topic);
  }
  return Refusal::kNone;
}

/// Null for somebody who has not announced itself: Fast DDS does not listen to it.
Refusal Guard::writer_of(std::uint32_t entity, Message& m, Writer*& out) {
  out = nullptr;
  if (m.participant == nullptr || m.elsewhere) return Refusal::kNone;
  auto& writers = m.participant->writers;
  const auto known = writers.find(entity);
  if (known == writers.end() && writers.size() >= Participants::kWritersOfOne)
    return Refusal::kTooManyWriters;
  out = known == writers.end() ? &writers[entity] : &known->second;
  return Refusal::kNone;
}

/// Null as above. low: what the reader certainly has, by what was for it or for all.
Refusal Guard::numbers_of(std::uint32_t reader, std::uint32_t writer, Message& m, NumberTrack*& out,
                          std::uint64_t& low) {
  out = nullptr;
  if (m.participant == nullptr || m.elsewhere) return Refusal::kNone;
  auto& numbers = m.participant->numbers;
  const auto known = numbers.find({reader, writer});
  if (known == numbers.end() && numbers.size() >= Participants::kPairsOfOne)
    return Refusal::kTooManyWriters;
  out = known == numbers.end() ? &numbers[{reader, writer}] : &known->second;
  const auto all = numbers.find({0, writer});
  low = std::max(out->low(), all == numbers.end() ? 0 : all->second.low());
  return Refusal::kNone;
}

void Guard::track(NumberTrack& numbers, std::uint64_t from, std::uint64_t to) {
  budget_.held -= std::min(budget_.held, numbers.held());
  numbers.add(from, to);
  budget_.held += numbers.held();
}

Refusal Guard::heartbeat(const Submessage& s, Message& m) {
  Cursor c(s.body, s.little());
  if (!c.has(28)) return Refusal::kShort;
  const std::uint32_t reader = entity(c.take(4)), writer = entity(c.take(4));
  const std::uint64_t first = c.sequence(), last = c.sequence();
  const std::uint32_t count = c.u32();
  if (first > kLastNumber || last > kLastNumber || last + 1 < first)
    return Refusal::kSequenceNumber;
  if (!belong_together(reader, writer)) return Refusal::kUnknownWriter;
  NumberTrack* numbers = nullptr;
  std::uint64_t low = 0;
  if (const Refusal flaw = numbers_of(reader, writer, m, numbers, low); flaw != Refusal::kNone)
    return flaw;
  if (numbers == nullptr) return Refusal::kNone;
  std::uint64_t begin = first;
  if (first > low + 1) {
    // A long way is gone in steps: a later heartbeat tells the rest.
    const std::uint64_t steps = budget_.take(first - 1 - low, m.now);
    if (steps == 0) return Refusal::kNumberJump;
    begin = low + 1 + steps;
    if (begin != first) m.patches.put_sequence(s.offset + 8, begin, s.little());
  }
  // A stale one is not read by Fast DDS, as far as it has read the same.
  if (!numbers->is_new_heartbeat(count)) return Refusal::kNone;
  budget_.held -= std::min(budget_.held, numbers->held());
  numbers->begin_at(begin);
  budget_.held += numbers->held();
  const auto known = m.participant->writers.find(writer);
  if (known != m.participant->writers.end()) known->second.fragments.forget_below(begin);
  return Refusal::kNone;
}

/// Fast DDS goes through all of [start, base), whatever it has already, and keeps each number that
/// is apart from what it has.
Refusal Guard::gap(const Submessage& s, Message& m) {
  Cursor c(s.body, s.little());
  if (!c.has(24)) return Refusal::kShort;
  const std::uint32_t reader = entity(c.take(4)), writer = entity(c.take(4));
  const std::uint64_t start = c.sequence(), base = c.sequence();
  if (start == 0 || base < start || base > kLastNumber) return Refusal::kSequenceNumber;
  Cursor set = c;
  if (const Refusal flaw = set_flaw(set); flaw != Refusal::kNone) return flaw;
  if (!belong_together(reader, writer)) return Refusal::kUnknownWriter;
  NumberTrack* numbers = nullptr;
  std::uint64_t low = 0;
  if (const Refusal flaw = numbers_of(reader, writer, m, numbers, low); flaw != Refusal::kNone)
    return flaw;
  if (numbers == nullptr) return Refusal::kNone;
  constexpr std::uint64_t kShort = 1024;
  const auto affordable = [&](std::uint64_t walked) {
    return budget_.take(walked * NumberBudget::kGapCosts, m.now) ==
           walked * NumberBudget::kGapCosts;
  };
  std::uint64_t until = base;
  if (base - start > kShort) {
    if (start <= low + 1 && base <= NumberBudget::kLongestGap) {
      // From the first on: nothing of it is then kept, whatever Fast DDS has got so far.
      if (!affordable(base)) return Refusal::kNumberJump;
      m.patches.put_sequence(s.offset + 8, 1, s.little());
      track(*numbers, start, base);
      return Refusal::kNone;
    }
    until = start + kShort;  // the rest is asked for again
    m.patches.put_sequence(s.offset + 16, until, s.little());
    m.patches.put32(s.offset + 24, 0, s.little());  // the set begins elsewhere
  }
  if (until > low + 1 && !budget_.hold(until - start, m.now)) return Refusal::kNumberJump;
  if (!affordable(until - start)) return Refusal::kNumberJump;
  track(*numbers, start, until);
  return Refusal::kNone;
}

Refusal Guard::data_frag(const Submessage& s, Message& m) {
  Cursor c(s.body, s.little());
  if (!c.has(32)) return Refusal::kShort;
  c.skip(2);
  if (c.u16() != 28) return Refusal::kShort;
  const std::uint32_t reader = entity(c.take(4)), writer = entity(c.take(4));
  Fragment f;
  f.sample = c.sequence();
  f.first = c.u32();
  f.count = c.u16();
  f.fragment_bytes = c.u16();
  f.sample_bytes = c.u32();
  if (f.sample == 0 || f.sample > kLastNumber) return Refusal::kSequenceNumber;
  if (!belong_together(reader, writer)) return Refusal::kUnknownWriter;
  if (is_builtin(writer)) return Refusal::kBuiltinFragment;
  if ((s.flags & 4U) != 0) return Refusal::kPayload;  // of a key
  Disposal none;
  if ((s.flags & 2U) != 0)
    if (const Refusal flaw = inline_qos(c, writer, m, none); flaw != Refusal::kNone) return flaw;
  if (const Refusal flaw = fragment_flaw(f, c.left()); flaw != Refusal::kNone) return flaw;
  if (f.sample_bytes > kLargestSample) return Refusal::kSampleSize;
  Writer* known = nullptr;
  if (const Refusal flaw = writer_of(writer, m, known); flaw != Refusal::kNone) return flaw;
  if (known == nullptr) return Refusal::kNone;
  const std::uint32_t bound = known->largest_sample != 0 ? known->largest_sample : kLargestSample;
  const std::size_t before = known->fragments.size();
  bool complete = false;
  const Refusal flaw = known->fragments.add(f, bound, complete);
  fragments_ += known->fragments.size() > before ? 1 : 0;
  NumberTrack* numbers = nullptr;
  std::uint64_t low = 0;
  if (complete && numbers_of(reader, writer, m, numbers, low) == Refusal::kNone &&
      numbers != nullptr)
    track(*numbers, f.sample, f.sample + 1);
  if (fragments_ > kFragmentedSamples) bound_fragments();
  return flaw;
}

/// The writer with the most loses the older half.
void Guard::bound_fragments() {
  fragments_ = 0;
  FragmentTrack* largest = nullptr;
  for (auto& [prefix, participant] : participants_.all())
    for (auto& [id, writer] : participant.writers) {
      fragments_ += writer.fragments.size();
      if (largest == nullptr || writer.fragments.size() > largest->size())
        largest = &writer.fragments;
    }
  if (largest == nullptr || fragments_ <= kFragmentedSamples) return;
  fragments_ -= largest->size() / 2;
  largest->forget_half();
}

}  // namespace crane::guard
