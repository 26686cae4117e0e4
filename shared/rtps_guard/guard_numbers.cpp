// SPDX-License-Identifier: Apache-2.0
// HEARTBEAT and GAP: how far a writer's numbers jump.

#include <algorithm>

#include "rtps_guard/guard_message.hpp"

namespace crane::guard {

/// Null as above. low: what the reader certainly has, by what was for it or for all.
Refusal Guard::numbers_of(std::uint32_t reader, std::uint32_t writer, Message& m, NumberTrack*& out,
                          std::uint64_t& low) {
  out = nullptr;
  if (m.participant == nullptr || m.elsewhere) return Refusal::kNone;
  auto& numbers = m.participant->numbers;
  const auto known = numbers.find({reader, writer});
  if (known == numbers.end() && numbers.size() >= Participant::kPairs)
    return Refusal::kTooManyEndpoints;
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

/// For this reader, or for all.
bool Guard::has_come(std::uint32_t reader, std::uint32_t writer, std::uint64_t number,
                     const Message& m) {
  if (m.participant == nullptr) return false;
  for (const std::uint32_t whose : {reader, 0U}) {
    const auto known = m.participant->numbers.find({whose, writer});
    if (known != m.participant->numbers.end() && known->second.has(number)) return true;
  }
  return false;
}

/// A reliable reader keeps the number of each sample that is apart from those before it.
Refusal Guard::sample(std::uint32_t reader, std::uint32_t writer, std::uint64_t number,
                      Message& m) {
  if (writer == kParticipants || writer == kHandshake) return Refusal::kNone;  // best effort
  NumberTrack* numbers = nullptr;
  std::uint64_t low = 0;
  if (const Refusal flaw = numbers_of(reader, writer, m, numbers, low); flaw != Refusal::kNone)
    return flaw;
  if (numbers == nullptr) return Refusal::kNone;
  if (!numbers->has(number) && number > numbers->low() + 1 &&
      (!numbers->has_room() ||
       (budget_.held >= NumberBudget::kHeld && m.participant->held() >= NumberBudget::kHeldOfOne)))
    return Refusal::kNumberJump;  // it comes again when those between have come
  track(*numbers, number, number + 1);
  return Refusal::kNone;
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

}  // namespace crane::guard
