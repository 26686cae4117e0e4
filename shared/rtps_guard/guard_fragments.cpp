// SPDX-License-Identifier: Apache-2.0
// DATA_FRAG: samples in parts.

#include <algorithm>

#include "rtps_guard/guard_message.hpp"

namespace crane::guard {
namespace {

/// The largest sample that any topic carries, and what its encoding adds.
constexpr std::uint32_t kLargestSample = (40U << 20U) + 65'536;
constexpr std::size_t kFragmentedSamples = 65'536;

}  // namespace

/// Null for somebody who has not announced itself: Fast DDS does not listen to it.
Refusal Guard::writer_of(std::uint32_t entity, Message& m, Writer*& out) {
  out = nullptr;
  if (m.participant == nullptr || m.elsewhere) return Refusal::kNone;
  auto& writers = m.participant->writers;
  const auto known = writers.find(entity);
  if (known == writers.end() && writers.size() >= Participant::kEndpoints)
    return Refusal::kTooManyEndpoints;
  out = known == writers.end() ? &writers[entity] : &known->second;
  return Refusal::kNone;
}

Refusal Guard::data_frag(const Submessage& s, Message& m, bool plain_only) {
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
  if (plain_only && writer != kHandshake) return Refusal::kUnprotected;
  if (is_builtin(writer) && writer != kHandshake) return Refusal::kBuiltinFragment;
  if ((s.flags & 4U) != 0) return Refusal::kPayload;  // of a key
  Disposal none;
  if ((s.flags & 2U) != 0)
    if (const Refusal flaw = inline_qos(c, s.offset, writer, m, none); flaw != Refusal::kNone)
      return flaw;
  if (const Refusal flaw = fragment_flaw(f, c.left()); flaw != Refusal::kNone) return flaw;
  if (writer == kHandshake) return handshake_part(s, f, reader, c.take(c.left()), m);
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

/// Fast DDS is handed the whole, if it fits; the parts become padding.
Refusal Guard::handshake_part(const Submessage& s, const Fragment& f, std::uint32_t reader,
                              Bytes bytes, Message& m) {
  if (s.to_the_end) return Refusal::kFragment;  // padding has to say how much
  m.patches.skip_submessage(s.offset - 4);
  if (m.participant == nullptr || m.elsewhere) return Refusal::kNone;
  Bytes whole;
  if (const Refusal flaw = handshakes_.add(m.sender.prefix, f, bytes, whole);
      flaw != Refusal::kNone || whole.empty())
    return flaw;
  if (!m.assembled.empty()) return Refusal::kFragment;  // nobody sends the ends of two at once
  Announcement nothing;
  const BuiltinContext context{m.sender, own_, options_.domain};
  if (const Refusal flaw = read_builtin(kHandshake, whole, 0, context, nothing, m.patches);
      flaw != Refusal::kNone)
    return flaw;
  m.assembled = data_message(m.header, m.sender.prefix, reader, kHandshake, f.sample, whole);
  return Refusal::kNone;
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
