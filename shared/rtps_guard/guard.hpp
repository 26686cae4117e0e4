// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "rtps_guard/builtin.hpp"
#include "rtps_guard/participants.hpp"
#include "rtps_guard/reassembly.hpp"

namespace crane::guard {

struct Options {
  int domain = -1;  ///< whose ports the group has; negative: not known
  /// A discovery server announces others: its prefix is that of 'fastdds discovery'.
  bool servers = false;
  /// All but announcements and the handshake is encrypted: what is plain is not let through.
  bool encrypted = false;
  /// The largest serialized sample of a topic; 0 if the topic is not known.
  std::function<std::uint32_t(const std::string& topic)> largest_sample = nullptr;
};

struct Verdict {
  Refusal refusal = Refusal::kNone;
  Patches patches;  ///< what must be changed before it is handed on
  /// A message to hand on after it: what came in parts, of which this was the last. Mostly empty.
  std::vector<std::uint8_t> assembled;
};

/// Reads every datagram before Fast DDS does: lets through what it knows, whole, and refuses the
/// rest. Thread-safe. Memory is bounded; each byte outside of users' payloads is read once.
class Guard {
 public:
  explicit Guard(Options options = {}) : options_(std::move(options)) {}

  void set_own_addresses(std::vector<Ipv4> addresses);
  /// Whose guard it is: what is for others is not followed, as Fast DDS does not read it.
  void set_self(const Prefix& self);
  /// `out` is reused: no memory is taken for a sound datagram of a known writer.
  void check(Bytes datagram, Ipv4 source, Clock::time_point now, Verdict& out);

 private:
  struct Message;   // what is known of the datagram so far
  struct Disposal;  // whose end it announces
  Refusal message(Bytes datagram, Message& m);
  Refusal change_source(const Prefix& prefix, Message& m);
  Refusal submessage(const Submessage& s, Message& m);
  Refusal secured(MessageWalk& walk, const Submessage& prefix, Message& m);
  Refusal data(const Submessage& s, Message& m);
  Refusal data_frag(const Submessage& s, Message& m, bool plain_only);
  Refusal heartbeat(const Submessage& s, Message& m);
  Refusal gap(const Submessage& s, Message& m);
  Refusal payload(std::uint32_t writer, Bytes bytes, std::size_t offset, bool again, Message& m,
                  Disposal& disposal);
  Refusal inline_qos(Cursor& c, std::size_t offset, std::uint32_t writer, Message& m,
                     Disposal& out);
  static bool has_come(std::uint32_t reader, std::uint32_t writer, std::uint64_t number,
                       const Message& m);
  Refusal sample(std::uint32_t reader, std::uint32_t writer, std::uint64_t number, Message& m);
  Refusal end(const Submessage& s, std::uint32_t writer, const Disposal& disposal, Message& m);
  Refusal remember(std::uint32_t writer, const Announcement& announced, bool again, Message& m);
  Refusal writer_of(std::uint32_t entity, Message& m, Writer*& out);
  Refusal numbers_of(std::uint32_t reader, std::uint32_t writer, Message& m, NumberTrack*& out,
                     std::uint64_t& low);
  void forget_numbers(Participant& participant, std::uint32_t writer);
  void track(NumberTrack& numbers, std::uint64_t from, std::uint64_t to);
  Refusal handshake_part(const Submessage& s, const Fragment& f, std::uint32_t reader, Bytes bytes,
                         Message& m);
  void bound_fragments();

  Options options_;
  std::mutex mutex_;
  OwnAddresses own_;
  Prefix self_{};  ///< zeros: not known yet
  Participants participants_;
  NumberBudget budget_;
  Reassembly handshakes_;
  std::size_t fragments_ = 0;  ///< samples that came in fragments, of all writers: an upper bound
};

}  // namespace crane::guard
