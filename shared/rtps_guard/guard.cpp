// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/guard.hpp"

#include <algorithm>
#include <utility>

#include "rtps_guard/guard_message.hpp"
#include "rtps_guard/tokens.hpp"

namespace crane::guard {
namespace {

/// 44.53.<id>.5f.45.50.52.4f.53.49.4d.41: 'fastdds discovery'.
bool is_server(const Prefix& p) {
  static constexpr Prefix kServer = {0x44, 0x53, 0,    0x5f, 0x45, 0x50,
                                     0x52, 0x4f, 0x53, 0x49, 0x4d, 0x41};
  return p[0] == kServer[0] && p[1] == kServer[1] &&
         std::equal(p.begin() + 3, p.end(), kServer.begin() + 3);
}

}  // namespace

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
  out.assembled.clear();
  const std::lock_guard lock(mutex_);
  budget_.held -= std::min(budget_.held, participants_.take_released());
  Message m{source, now, {}, nullptr, 0, false, false, out.patches, out.assembled, datagram};
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
  if (m.now - m.participant->heard > m.participant->lease) {
    forget_numbers(*m.participant, 0);
    m.participant->lapse();
  }
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
      return data_frag(s, m, plain_only);
    case kHeartbeatFrag: {
      const bool of_handshake = s.body.size() >= 8 && entity(s.body.subspan(4)) == kHandshake;
      return plain_only && !of_handshake ? Refusal::kUnprotected : heartbeat_frag_flaw(c);
    }
    default: {
      constexpr std::uint16_t kEprosima = 0x010F;
      // Statistics were measured by the walk. What other vendors add is skipped by all.
      const bool skipped = s.id == kVendorFirst || (s.id > kVendorFirst && m.vendor != kEprosima);
      return skipped ? Refusal::kNone : Refusal::kUnknownSubmessage;
    }
  }
}

}  // namespace crane::guard
