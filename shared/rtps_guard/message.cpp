// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/message.hpp"

#include <algorithm>

namespace crane::guard {
namespace {

constexpr std::size_t kHeaderBytes = 20;
constexpr std::size_t kStatisticsBytes = 56;
constexpr std::uint16_t kEprosima = 0x010F;

bool has_rtps_header(Bytes d) {
  return d.size() >= kHeaderBytes && d[0] == 'R' && d[1] == 'T' && d[2] == 'P' && d[3] == 'S' &&
         d[4] == 2;
}

}  // namespace

MessageWalk::MessageWalk(Bytes datagram) : datagram_(datagram), at_(kHeaderBytes) {
  if (!has_rtps_header(datagram)) {
    refuse(Refusal::kHeader);
    return;
  }
  header_.vendor = static_cast<std::uint16_t>(datagram[6] << 8U | datagram[7]);
  std::copy_n(datagram.begin() + 8, header_.prefix.size(), header_.prefix.begin());
}

bool MessageWalk::refuse(Refusal refusal) {
  refusal_ = refusal;
  at_ = datagram_.size();
  return false;
}

bool MessageWalk::next(Submessage& out) {
  if (refusal_ != Refusal::kNone || at_ >= datagram_.size()) return false;
  if (datagram_.size() - at_ < 4) return refuse(Refusal::kLength);
  out.id = datagram_[at_];
  out.flags = datagram_[at_ + 1];
  const std::uint8_t first = datagram_[at_ + 2], second = datagram_[at_ + 3];
  std::size_t length = out.little() ? first | second << 8U : second | first << 8U;
  at_ += 4;
  const std::size_t left = datagram_.size() - at_;
  out.offset = at_;
  if (out.id == kVendorFirst && header_.vendor == kEprosima) {
    // Fast DDS asserts on exactly this, and writes the length little-endian whatever its flag.
    if (left != kStatisticsBytes || first != kStatisticsBytes || second != 0)
      return refuse(Refusal::kStatistics);
    length = kStatisticsBytes;
  }
  // Zero: up to the end, except where nothing follows by nature.
  out.to_the_end = length == 0 && out.id != kPad && out.id != kInfoTs;
  if (out.to_the_end) length = left;
  if (length > left) return refuse(Refusal::kLength);
  if (length % 4 != 0 && length != left) return refuse(Refusal::kUnaligned);
  out.body = datagram_.subspan(at_, length);
  at_ += length;
  return true;
}

}  // namespace crane::guard
