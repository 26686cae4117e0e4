// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "rtps_guard/cursor.hpp"
#include "rtps_guard/refusal.hpp"

namespace crane::guard {

// Submessages (DDSI-RTPS 2.3, 9.4.5; DDS Security 1.1, 7.3.6).
enum : std::uint8_t {
  kPad = 0x01,
  kAckNack = 0x06,
  kHeartbeat = 0x07,
  kGap = 0x08,
  kInfoTs = 0x09,
  kInfoSrc = 0x0C,
  kInfoDst = 0x0E,
  kNackFrag = 0x12,
  kHeartbeatFrag = 0x13,
  kData = 0x15,
  kDataFrag = 0x16,
  kSecBody = 0x30,
  kSecPrefix = 0x31,
  kSecPostfix = 0x32,
  kSrtpsPrefix = 0x33,
  kSrtpsPostfix = 0x34,
  kVendorFirst = 0x80,  ///< eProsima: statistics
};

using Prefix = std::array<std::uint8_t, 12>;

struct Header {
  Prefix prefix{};
  std::uint16_t vendor = 0;
};

struct Submessage {
  std::uint8_t id = 0, flags = 0;
  Bytes body;               ///< without its header of 4 bytes
  std::size_t offset = 0;   ///< of the body in the datagram
  bool to_the_end = false;  ///< its length is said to be 0: all that is left
  [[nodiscard]] bool little() const { return (flags & 1U) != 0; }
};

/// The submessages of one datagram, one after another, exactly as Fast DDS 2.9.1 goes through them
/// (MessageReceiver::processCDRMsg): each begins at a multiple of 4 behind the last one's header.
/// What two readers could go through differently is refused: a length that is no multiple of 4
/// except in the last, bytes behind the last, statistics that are not at the end.
class MessageWalk {
 public:
  explicit MessageWalk(Bytes datagram);

  /// Of the header at first; then of next().
  [[nodiscard]] Refusal refusal() const { return refusal_; }
  [[nodiscard]] const Header& header() const { return header_; }
  /// False at the end, or if refusal() has a reason.
  bool next(Submessage& out);

 private:
  bool refuse(Refusal refusal);

  Bytes datagram_;
  Header header_;
  std::size_t at_ = 0;
  Refusal refusal_ = Refusal::kNone;
};

}  // namespace crane::guard
