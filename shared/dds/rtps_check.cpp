#include "dds/rtps_check.hpp"

#include <algorithm>
#include <utility>

namespace crane::dds {
namespace {

using Bytes = std::span<const std::uint8_t>;

// Submessages (DDSI-RTPS 9.4.5).
enum : std::uint8_t {
  kPad = 0x01,
  kAckNack = 0x06,
  kHeartbeat = 0x07,
  kGap = 0x08,
  kInfoTs = 0x09,
  kInfoSrc = 0x0C,
  kInfoReplyIp4 = 0x0D,
  kInfoDst = 0x0E,
  kInfoReply = 0x0F,
  kNackFrag = 0x12,
  kHeartbeatFrag = 0x13,
  kData = 0x15,
  kDataFrag = 0x16,
  kSecureFirst = 0x30,
  kSecureLast = 0x34,
  kStatistics = 0x80,  // eProsima's
};

constexpr std::size_t kHeader = 20;
constexpr std::size_t kStatisticsLength = 56;
/// The largest sample that any topic carries, and what its encoding adds.
constexpr std::uint32_t kLargestSample = (32U << 20U) + 65'536;
/// A gap is walked number by number: so many at most.
constexpr std::uint64_t kLongestGap = 1ULL << 28U;

class Reader {
 public:
  Reader(Bytes bytes, bool little) : bytes_(bytes), little_(little) {}

  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool has(std::size_t n) const { return left() >= n; }
  void skip(std::size_t n) { at_ += n; }
  Bytes take(std::size_t n) {
    const Bytes out = bytes_.subspan(at_, n);
    at_ += n;
    return out;
  }
  /// The caller has asked has().
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return number(4); }
  /// High half first, whatever the byte order. Negative ones are larger than any legal one.
  std::uint64_t sequence() {
    const std::uint64_t high = u32();
    return high << 32U | u32();
  }

 private:
  std::uint32_t number(int n) {
    std::uint32_t value = 0;
    for (int i = 0; i < n; ++i) {
      const std::uint32_t byte = bytes_[at_ + static_cast<std::size_t>(i)];
      value |= byte << (8 * (little_ ? i : n - 1 - i));
    }
    at_ += static_cast<std::size_t>(n);
    return value;
  }
  Bytes bytes_;
  std::size_t at_ = 0;
  bool little_;
};

constexpr std::uint64_t kMaxSequence = 0x7FFF'FFFF'FFFF'FFFFULL;

/// Number of bits, bitmap.
const char* bitmap_flaw(Reader& r) {
  if (!r.has(4)) return "a set without its number of bits";
  const std::uint32_t bits = r.u32();
  if (bits > 256) return "a set of more than 256 bits";
  const std::size_t bytes = (bits + 31) / 32 * 4;
  if (!r.has(bytes)) return "a set shorter than its number of bits";
  r.skip(bytes);
  return nullptr;
}

const char* string_flaw(Reader& r) {
  if (!r.has(4)) return "a string without its length";
  const std::uint32_t length = r.u32();
  const std::size_t padded = (std::size_t{length} + 3) / 4 * 4;
  if (length == 0 || !r.has(length)) return "a string longer than its parameter";
  const Bytes text = r.take(std::min(padded, r.left()));
  return text[length - 1] == 0 ? nullptr : "a string without its end";
}

/// What Fast DDS takes on trust of discovery's parameters (DDSI-RTPS 9.6.2.2).
const char* parameter_flaw(std::uint16_t id, Bytes value, bool little) {
  Reader r(value, little);
  const auto exactly = [&](std::size_t size) {
    return value.size() == size ? nullptr : "a parameter of another size than its kind has";
  };
  switch (id) {
    case 0x0070:  // KEY_HASH
    case 0x0050:  // PARTICIPANT_GUID
    case 0x0052:  // GROUP_GUID
    case 0x005A:  // ENDPOINT_GUID
      return exactly(16);
    case 0x0071:  // STATUS_INFO
    case 0x0015:  // PROTOCOL_VERSION
    case 0x0016:  // VENDORID
      return exactly(4);
    case 0x0083:  // RELATED_SAMPLE_IDENTITY
    case 0x800F:
    case 0x002F:  // locators
    case 0x0030:
    case 0x0031:
    case 0x0032:
    case 0x0033:
    case 0x0048:
      return exactly(24);
    case 0x0005:  // TOPIC_NAME
    case 0x0007:  // TYPE_NAME
    case 0x0062:  // ENTITY_NAME
      return string_flaw(r);
    case 0x0029: {  // PARTITION
      if (!r.has(4)) return "a list without its length";
      for (std::uint32_t n = r.u32(); n > 0; --n)
        if (const char* flaw = string_flaw(r)) return flaw;
      return nullptr;
    }
    case 0x0059: {  // PROPERTY_LIST
      if (!r.has(4)) return "a list without its length";
      for (std::uint32_t n = r.u32(); n > 0; --n)
        for (int side = 0; side < 2; ++side)
          if (const char* flaw = string_flaw(r)) return flaw;
      return nullptr;
    }
    case 0x002C:  // USER_DATA
    case 0x002D:  // GROUP_DATA
    case 0x002E:  // TOPIC_DATA
      if (!r.has(4) || r.u32() > r.left()) return "data longer than its parameter";
      return nullptr;
    default:
      return nullptr;
  }
}

const char* parameters_flaw(Reader& r, bool little) {
  for (;;) {
    if (!r.has(4)) return "a parameter list without its end";
    const std::uint16_t id = r.u16();
    const std::uint16_t length = r.u16();
    if (id == 0x0001) return nullptr;  // the end
    if (length % 4 != 0 || !r.has(length)) return "a parameter longer than its list";
    if (const char* flaw = parameter_flaw(id, r.take(length), little)) return flaw;
  }
}

/// Writers of discovery: their payloads are parameter lists.
bool is_discovery(std::uint32_t writer_big_endian) {
  return writer_big_endian == 0x000100C2 || writer_big_endian == 0x000003C2 ||
         writer_big_endian == 0x000004C2;
}

std::uint32_t entity(Bytes id) {
  return std::uint32_t(id[0]) << 24U | std::uint32_t(id[1]) << 16U | std::uint32_t(id[2]) << 8U |
         id[3];
}

struct Fragment {
  std::uint32_t writer = 0, sample_size = 0, fragment_size = 0;
  std::uint64_t number = 0;
};

const char* data_flaw(Bytes body, std::uint8_t flags) {
  const bool little = (flags & 1U) != 0;
  const bool inline_qos = (flags & 2U) != 0, data = (flags & 4U) != 0, key = (flags & 8U) != 0;
  if (data && key) return "DATA with both data and key";
  Reader r(body, little);
  if (!r.has(20)) return "DATA too short";
  r.skip(2);
  const std::uint16_t to_qos = r.u16();
  r.skip(4);
  const std::uint32_t writer = entity(r.take(4));
  const std::uint64_t number = r.sequence();
  if (number == 0 || number > kMaxSequence) return "DATA with an illegal sequence number";
  if (to_qos < 16 || !r.has(to_qos - 16U)) return "DATA with an illegal offset";
  r.skip(to_qos - 16U);
  if (inline_qos)
    if (const char* flaw = parameters_flaw(r, little)) return flaw;
  if (!data && !key) return nullptr;
  if (!r.has(4)) return "DATA with a payload too short";
  if (!data || !is_discovery(writer)) return nullptr;
  const Bytes kind = r.take(4);
  if (kind[0] != 0 || (kind[1] != 2 && kind[1] != 3)) return "discovery that is no parameter list";
  Reader list(r.take(r.left()), kind[1] == 3);
  return parameters_flaw(list, kind[1] == 3);
}

const char* data_frag_flaw(Bytes body, std::uint8_t flags, Fragment& out) {
  const bool little = (flags & 1U) != 0;
  Reader r(body, little);
  if (!r.has(32)) return "DATA_FRAG too short";
  r.skip(2);
  const std::uint16_t to_qos = r.u16();
  r.skip(4);
  out.writer = entity(r.take(4));
  out.number = r.sequence();
  const std::uint32_t first = r.u32();
  const std::uint16_t count = r.u16();
  out.fragment_size = r.u16();
  out.sample_size = r.u32();
  if (out.number == 0 || out.number > kMaxSequence)
    return "DATA_FRAG with an illegal sequence number";
  if (to_qos < 28 || !r.has(to_qos - 28U)) return "DATA_FRAG with an illegal offset";
  r.skip(to_qos - 28U);
  if ((flags & 2U) != 0)
    if (const char* flaw = parameters_flaw(r, little)) return flaw;
  if (first == 0 || count == 0 || out.fragment_size < 8)
    return "DATA_FRAG without fragments, or too small ones";
  if (out.sample_size > kLargestSample) return "DATA_FRAG of a larger sample than any topic has";
  const std::uint64_t begin = std::uint64_t(first - 1) * out.fragment_size;
  if (begin >= out.sample_size) return "DATA_FRAG beyond its sample";
  const std::uint64_t end =
      std::min<std::uint64_t>(begin + std::uint64_t(count) * out.fragment_size, out.sample_size);
  if (begin + std::uint64_t(count - 1) * out.fragment_size >= out.sample_size)
    return "DATA_FRAG with more fragments than its sample";
  if (r.left() < end - begin) return "DATA_FRAG shorter than its fragments";
  return nullptr;
}

const char* submessage_flaw(std::uint8_t id, std::uint8_t flags, Bytes body, Fragment& fragment) {
  Reader r(body, (flags & 1U) != 0);
  switch (id) {
    case kPad:
      return nullptr;
    case kAckNack: {
      if (!r.has(16)) return "ACKNACK too short";
      r.skip(8);
      if (r.sequence() > kMaxSequence) return "ACKNACK with an illegal sequence number";
      if (const char* flaw = bitmap_flaw(r)) return flaw;
      return r.has(4) ? nullptr : "ACKNACK without its count";
    }
    case kHeartbeat: {
      if (!r.has(28)) return "HEARTBEAT too short";
      r.skip(8);
      const std::uint64_t first = r.sequence();
      const std::uint64_t last = r.sequence();
      return first <= kMaxSequence && last <= kMaxSequence && last + 1 >= first
                 ? nullptr
                 : "HEARTBEAT with illegal sequence numbers";
    }
    case kGap: {
      if (!r.has(24)) return "GAP too short";
      r.skip(8);
      const std::uint64_t start = r.sequence();
      const std::uint64_t base = r.sequence();
      if (start == 0 || base < start || base > kMaxSequence || base - start > kLongestGap)
        return "GAP with illegal sequence numbers";
      return bitmap_flaw(r);
    }
    case kInfoTs:
      return (flags & 2U) != 0 || body.size() >= 8 ? nullptr : "INFO_TS too short";
    case kInfoSrc:
      return body.size() >= 20 ? nullptr : "INFO_SRC too short";
    case kInfoDst:
      return body.size() >= 12 ? nullptr : "INFO_DST too short";
    case kInfoReply:
    case kInfoReplyIp4:
      return "INFO_REPLY, which nobody here sends";
    case kNackFrag: {
      if (!r.has(20)) return "NACK_FRAG too short";
      r.skip(8);
      if (const std::uint64_t n = r.sequence(); n == 0 || n > kMaxSequence)
        return "NACK_FRAG with an illegal sequence number";
      if (r.u32() == 0) return "NACK_FRAG of fragment 0";
      if (const char* flaw = bitmap_flaw(r)) return flaw;
      return r.has(4) ? nullptr : "NACK_FRAG without its count";
    }
    case kHeartbeatFrag:
      return body.size() >= 24 ? nullptr : "HEARTBEAT_FRAG too short";
    case kData:
      return data_flaw(body, flags);
    case kDataFrag:
      return data_frag_flaw(body, flags, fragment);
    default:
      // Security: encrypted, only its length can be checked. Other vendors' own: skipped by all.
      return (id >= kSecureFirst && id <= kSecureLast) || id > kStatistics
                 ? nullptr
                 : "an unknown submessage";
  }
}

bool is_announcement(std::uint8_t id, Bytes body) {
  return id == kData && entity(body.subspan(8, 4)) == 0x000100C2;
}

/// Calls seen(prefix of the source, fragment) for every fragment, and announced(prefix) for what
/// participants say of themselves.
template <class Seen, class Announced>
const char* walk(Bytes datagram, Seen seen, Announced announced) {
  if (datagram.size() < kHeader) return "shorter than a header";
  if (datagram[0] != 'R' || datagram[1] != 'T' || datagram[2] != 'P' || datagram[3] != 'S')
    return "no RTPS";
  if (datagram[4] != 2) return "another major version";
  Bytes prefix = datagram.subspan(8, 12);
  for (std::size_t at = kHeader; at < datagram.size();) {
    if (datagram.size() - at < 4) return "bytes behind the last submessage";
    const std::uint8_t id = datagram[at];
    const std::uint8_t flags = datagram[at + 1];
    std::size_t length = (flags & 1U) != 0 ? datagram[at + 2] | datagram[at + 3] << 8U
                                           : datagram[at + 3] | datagram[at + 2] << 8U;
    at += 4;
    const std::size_t left = datagram.size() - at;
    if (id == kStatistics) {
      // An assertion of Fast DDS's counts on exactly this. (Its length is little-endian whatever
      // its flag.)
      if (left != kStatisticsLength || datagram[at - 2] != kStatisticsLength ||
          datagram[at - 1] != 0)
        return "statistics of another size, or not at the end";
      return nullptr;
    }
    // Zero: up to the end, except where nothing follows by nature.
    if (length == 0 && id != kPad && id != kInfoTs) length = left;
    if (length > left) return "a submessage longer than the datagram";
    const Bytes body = datagram.subspan(at, length);
    Fragment fragment;
    if (const char* flaw = submessage_flaw(id, flags, body, fragment)) return flaw;
    if (id == kInfoSrc) prefix = body.subspan(8, 12);
    if (id == kDataFrag)
      if (const char* flaw = seen(prefix, fragment)) return flaw;
    if (is_announcement(id, body))
      if (const char* flaw = announced(prefix)) return flaw;
    at += length;
  }
  return nullptr;
}

}  // namespace

const char* rtps_flaw(std::span<const std::uint8_t> datagram) {
  return walk(
      datagram, [](Bytes, const Fragment&) -> const char* { return nullptr; },
      [](Bytes) -> const char* { return nullptr; });
}

const char* RtpsCheck::flaw(std::span<const std::uint8_t> datagram) {
  return walk(
      datagram,
      [this](Bytes prefix, const Fragment& f) {
        return fragment_flaw(prefix, f.writer, f.number, {f.sample_size, f.fragment_size});
      },
      [this](Bytes prefix) { return newcomer_flaw(prefix, Clock::now()); });
}

const char* RtpsCheck::fragment_flaw(Bytes prefix, std::uint32_t writer, std::uint64_t number,
                                     const Sizes& sizes) {
  Sample sample;
  std::copy(prefix.begin(), prefix.end(), sample.prefix.begin());
  sample.writer = writer;
  sample.number = number;
  const std::lock_guard lock(mutex_);
  const auto [known, fresh] = fragmented_.try_emplace(sample, sizes);
  if (!fresh) return known->second == sizes ? nullptr : "fragments of one sample that do not agree";
  fragmented_.erase(std::exchange(recent_[next_], sample));
  next_ = (next_ + 1) % recent_.size();
  return nullptr;
}

const char* RtpsCheck::newcomer_flaw(Bytes prefix, Clock::time_point now) {
  constexpr auto kRemembered = std::chrono::seconds(60);  // who is there says so at least so often
  std::array<std::uint8_t, 12> who{};
  std::copy(prefix.begin(), prefix.end(), who.begin());
  const std::lock_guard lock(mutex_);
  if (const auto known = participants_.find(who); known != participants_.end()) {
    known->second = now;
    return nullptr;
  }
  const double passed_s = std::chrono::duration<double>(now - filled_).count();
  newcomers_ = std::min(kNewcomersAtOnce, newcomers_ + passed_s * kNewcomersPerSecond);
  filled_ = now;
  if (newcomers_ < 1) return "announcement of too many new participants at once";
  newcomers_ -= 1;
  if (participants_.size() >= kParticipants)
    std::erase_if(participants_, [&](const auto& p) { return now - p.second > kRemembered; });
  participants_[who] = now;
  return nullptr;
}

}  // namespace crane::dds
