// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

namespace crane::test {

using Datagram = std::vector<std::uint8_t>;

/// Writes RTPS by hand: what a test wants to say, right or wrong.
class Rtps {
 public:
  using Prefix = std::array<std::uint8_t, 12>;
  static constexpr Prefix kMe = {1, 15, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  static constexpr std::uint32_t kSpdp = 0x000100C2, kPublications = 0x000003C2,
                                 kSubscriptions = 0x000004C2, kLiveliness = 0x000200C2,
                                 kHandshake = 0x000201C3;

  explicit Rtps(const Prefix& prefix = kMe, std::uint16_t vendor = 0x010F) : prefix_(prefix) {
    d_ = {'R', 'T', 'P', 'S', 2, 3, std::uint8_t(vendor >> 8U), std::uint8_t(vendor & 255U)};
    d_.insert(d_.end(), prefix.begin(), prefix.end());
  }
  operator const Datagram&() const { return d_; }
  [[nodiscard]] const Datagram& bytes() const { return d_; }

  /// Little-endian; a length other than the body's if not negative.
  Rtps& add(std::uint8_t id, std::uint8_t flags, const Datagram& body, int length = -1) {
    const std::size_t n = length < 0 ? body.size() : static_cast<std::size_t>(length);
    d_.insert(d_.end(),
              {id, std::uint8_t(flags | 1U), std::uint8_t(n & 255U), std::uint8_t(n >> 8U)});
    d_.insert(d_.end(), body.begin(), body.end());
    return *this;
  }
  Rtps& heartbeat(std::uint32_t writer, std::uint64_t first, std::uint64_t last,
                  std::uint32_t count) {
    return add(7, 2, cat({entity(0), entity(writer), number(first), number(last), u32(count)}));
  }
  Rtps& gap(std::uint32_t writer, std::uint64_t start, std::uint64_t base) {
    return add(8, 0, cat({entity(0), entity(writer), number(start), number(base), u32(0)}));
  }
  Rtps& data(std::uint32_t writer, std::uint64_t n, const Datagram& payload, std::uint8_t flags = 4,
             const Datagram& inline_qos = {}) {
    return add(0x15, flags | (inline_qos.empty() ? 0 : 2),
               cat({{0, 0, 16, 0}, entity(0), entity(writer), number(n), inline_qos, payload}));
  }
  Rtps& fragment(std::uint32_t writer, std::uint64_t n, std::uint32_t first, std::uint16_t size,
                 std::uint32_t sample, std::size_t bytes, std::uint16_t count = 1) {
    return add(0x16, 0,
               cat({{0, 0, 28, 0},
                    entity(0),
                    entity(writer),
                    number(n),
                    u32(first),
                    u32(std::uint32_t(size) << 16U | count),
                    u32(sample),
                    Datagram(bytes, 0)}));
  }
  /// A participant as it announces itself; further parameters behind.
  Rtps& announce(std::uint32_t lease_s = 10, const std::string& address = "127.0.0.1",
                 const Datagram& more = {}, std::uint16_t port = 7410) {
    return data(
        kSpdp, 1,
        list({parameter(0x15, {2, 3, 0, 0}), parameter(0x16, {1, 15, 0, 0}),
              parameter(0x50, guid(prefix_, 0x1C1)), parameter(0x32, locator(address, port)),
              parameter(0x31, locator(address, port)), parameter(0x02, cat({u32(lease_s), u32(0)})),
              parameter(0x58, u32(0xC3F)), more}));
  }
  Rtps& announce_writer(std::uint32_t writer, const std::string& topic) {
    return data(kPublications, 1,
                list({parameter(0x50, guid(prefix_, 0x1C1)), parameter(0x5A, guid(prefix_, writer)),
                      parameter(0x05, string(topic)), parameter(0x07, string("T"))}));
  }
  /// A reliable reader or writer (`list`: kSubscriptions, kPublications) that matches ours; its
  /// n-th announcement.
  Rtps& announce_endpoint(std::uint32_t where, std::uint64_t n, std::uint32_t endpoint,
                          const std::string& topic, const std::string& type) {
    return data(where, n,
                list({parameter(0x5A, guid(prefix_, endpoint)), parameter(0x05, string(topic)),
                      parameter(0x07, string("crane::v1::" + type)),
                      parameter(0x1A, cat({u32(2), u32(0), u32(100'000'000)})),
                      parameter(0x1D, u32(1)), parameter(0x1F, u32(type == "MapTile" ? 1 : 0)),
                      parameter(0x29, cat({u32(1), string("crane_1")})),
                      parameter(0x70, guid(prefix_, endpoint))}));
  }
  /// The end of a participant or endpoint: 1 disposed, 2 unregistered, 3 both.
  Rtps& end(std::uint32_t where, std::uint64_t n, std::uint32_t subject, std::uint8_t how = 3) {
    return data(where, n, list({parameter(where == kSpdp ? 0x50 : 0x5A, guid(prefix_, subject))}),
                8,
                cat({parameter(0x71, {0, 0, 0, how}),
                     parameter(0x70, guid(prefix_, subject)),
                     {1, 0, 0, 0}}));
  }
  Rtps& acknack(std::uint32_t reader, std::uint32_t writer, std::uint64_t base, std::uint32_t bits,
                std::uint32_t count) {
    return add(6, 0,
               cat({entity(reader), entity(writer), number(base), u32(bits),
                    Datagram((bits + 31) / 32 * 4, 0xFF), u32(count)}));
  }
  Rtps& nack_frag(std::uint32_t reader, std::uint32_t writer, std::uint64_t n, std::uint32_t base,
                  std::uint32_t bits, std::uint32_t count) {
    return add(0x12, 0,
               cat({entity(reader), entity(writer), number(n), u32(base), u32(bits),
                    Datagram((bits + 31) / 32 * 4, 0xFF), u32(count)}));
  }
  Rtps& heartbeat_frag(std::uint32_t writer, std::uint64_t n, std::uint32_t last,
                       std::uint32_t count) {
    return add(0x13, 0, cat({entity(0), entity(writer), number(n), u32(last), u32(count)}));
  }
  /// ParticipantMessageData of a kind: 1 automatic, 2 by participant.
  Rtps& alive(std::uint64_t n, std::uint8_t kind, std::size_t octets = 0) {
    return data(kLiveliness, n,
                cat({{0, 1, 0, 0},
                     Datagram(prefix_.begin(), prefix_.end()),
                     {0, 0, 0, kind},
                     u32(std::uint32_t(octets)),
                     Datagram(octets, 0)}));
  }

  static Datagram u32(std::uint32_t v) {
    return {std::uint8_t(v), std::uint8_t(v >> 8U), std::uint8_t(v >> 16U), std::uint8_t(v >> 24U)};
  }
  static Datagram entity(std::uint32_t v) {
    return {std::uint8_t(v >> 24U), std::uint8_t(v >> 16U), std::uint8_t(v >> 8U), std::uint8_t(v)};
  }
  static Datagram number(std::uint64_t v) {
    return cat({u32(std::uint32_t(v >> 32U)), u32(std::uint32_t(v))});
  }
  static Datagram guid(const Prefix& prefix, std::uint32_t e) {
    return cat({Datagram(prefix.begin(), prefix.end()), entity(e)});
  }
  static Datagram string(const std::string& s) {
    Datagram out = cat({u32(std::uint32_t(s.size() + 1)), Datagram(s.begin(), s.end()), {0}});
    out.resize((out.size() + 3) / 4 * 4);
    return out;
  }
  static Datagram locator(const std::string& ip, std::uint32_t port, std::uint32_t kind = 1);
  static Datagram parameter(std::uint16_t id, const Datagram& value) {
    return cat({{std::uint8_t(id & 255U), std::uint8_t(id >> 8U), std::uint8_t(value.size() & 255U),
                 std::uint8_t(value.size() >> 8U)},
                value});
  }
  static Datagram list(std::initializer_list<Datagram> parameters) {
    return cat({{0, 3, 0, 0}, cat(parameters), {1, 0, 0, 0}});
  }
  static Datagram cat(std::initializer_list<Datagram> parts) {
    Datagram out;
    for (const Datagram& p : parts) out.insert(out.end(), p.begin(), p.end());
    return out;
  }

 private:
  Prefix prefix_;
  Datagram d_;
};

inline Datagram Rtps::locator(const std::string& ip, std::uint32_t port, std::uint32_t kind) {
  Datagram out = cat({u32(kind), u32(port), Datagram(12, 0)});
  std::uint32_t byte = 0;
  for (const char c : ip + ".") {
    if (c != '.') {
      byte = byte * 10 + static_cast<std::uint32_t>(c - '0');
      continue;
    }
    out.push_back(static_cast<std::uint8_t>(byte));
    byte = 0;
  }
  return out;
}

}  // namespace crane::test
