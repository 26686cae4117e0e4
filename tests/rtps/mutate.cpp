// SPDX-License-Identifier: Apache-2.0
#include "mutate.hpp"

#include <algorithm>
#include <utility>

namespace crane::test {
namespace {

void put(Datagram& d, std::size_t at, std::uint32_t value, std::size_t bytes, bool little) {
  for (std::size_t i = 0; i < bytes && at + i < d.size(); ++i)
    d[at + i] = static_cast<std::uint8_t>(value >> (8 * (little ? i : bytes - 1 - i)));
}

std::uint32_t get(const Datagram& d, std::size_t at, std::size_t bytes, bool little) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes && at + i < d.size(); ++i)
    value |= std::uint32_t(d[at + i]) << (8 * (little ? i : bytes - 1 - i));
  return value;
}

}  // namespace

Mutator::Mutator(std::vector<Datagram> corpus, std::uint32_t seed)
    : corpus_(std::move(corpus)), random_(seed) {}

std::uint32_t Mutator::nasty() {
  static constexpr std::uint32_t kValues[] = {
      0,          1,          2,          3,          8,          255,        256,
      257,        1023,       1024,       0x7FFF,     0x8000,     0xFFFF,     0x10000,
      0x01000000, 0x02000000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFF0, 0xFFFFFFFE, 0xFFFFFFFF};
  if (below(3) == 0) return static_cast<std::uint32_t>(random_());
  return kValues[below(std::size(kValues))];
}

std::vector<Mutator::Part> Mutator::split(const Datagram& d) const {
  std::vector<Part> parts;
  for (std::size_t at = 20; at + 4 <= d.size();) {
    Part p{d[at], d[at + 1], {}};
    std::size_t length = get(d, at + 2, 2, (p.flags & 1U) != 0);
    at += 4;
    if (length == 0 || length > d.size() - at) length = d.size() - at;
    p.body.assign(d.begin() + std::ptrdiff_t(at), d.begin() + std::ptrdiff_t(at + length));
    parts.push_back(std::move(p));
    at += length;
  }
  return parts;
}

Datagram Mutator::join(const Datagram& header, const std::vector<Part>& parts) {
  Datagram d(header.begin(), header.begin() + 20);
  for (const Part& p : parts) {
    if (p.id == 0x80 && &p != &parts.back() && below(4) != 0) continue;
    std::size_t length = p.body.size();
    if (below(200) == 0) length = nasty() & 0xFFFFU;
    if (&p == &parts.back() && below(50) == 0) length = 0;
    d.insert(d.end(), {p.id, p.flags, 0, 0});
    put(d, d.size() - 2, std::uint32_t(length), 2, (p.flags & 1U) != 0 || p.id == 0x80);
    d.insert(d.end(), p.body.begin(), p.body.end());
    while (d.size() % 4 != 0 && below(20) != 0) d.push_back(0);
    if (d.size() > 65'000) break;
  }
  return d;
}

/// Some of the 32-bit numbers behind `at`.
void Mutator::change_numbers(Part& p, std::size_t at, std::size_t words) {
  const bool little = (p.flags & 1U) != 0;
  for (std::size_t n = 1 + below(2); n > 0; --n) {
    const std::size_t where = at + 4 * below(words);
    const std::uint32_t old = get(p.body, where, 4, little);
    const std::uint32_t value = below(2) == 0 ? nasty() : old + std::uint32_t(below(2000)) - 1000;
    put(p.body, where, value, 4, little);
  }
}

/// A parameter list from `at` on.
void Mutator::change_list(Datagram& d, std::size_t at, bool little) {
  std::vector<std::pair<std::size_t, std::size_t>> parameters;  // where, whole length
  while (at + 4 <= d.size() && parameters.size() < 200) {
    const std::size_t length = get(d, at + 2, 2, little);
    if (get(d, at, 2, little) == 1 || at + 4 + length > d.size()) break;
    parameters.emplace_back(at, 4 + length);
    at += 4 + length;
  }
  if (parameters.empty()) return change_bytes(d);
  const auto [where, length] = parameters[below(parameters.size())];
  switch (below(9)) {
    case 0:
      return put(d, where, nasty(), 2, little);  // another kind
    case 1:
      return put(d, where + 2, nasty(), 2, little);
    case 2:  // twice
      d.insert(d.begin() + std::ptrdiff_t(where), d.begin() + std::ptrdiff_t(where),
               d.begin() + std::ptrdiff_t(where + length));
      return;
    case 3:
      d.erase(d.begin() + std::ptrdiff_t(where), d.begin() + std::ptrdiff_t(where + length));
      return;
    case 4:
    case 5:  // a count or a number in it
      return put(d, where + 4 + 4 * below((length - 4) / 4 + 1), nasty(), 4, little);
    case 6: {  // a made-up one
      static constexpr std::uint16_t kIds[] = {
          0x02, 0x05, 0x07, 0x29, 0x2C, 0x2F, 0x32, 0x35,   0x50,   0x59,   0x5A,  0x62,
          0x69, 0x70, 0x71, 0x72, 0x73, 0x74, 0x75, 0x1001, 0x1002, 0x8006, 0x800F};
      Datagram made(4 + 4 * below(20), 0);
      put(made, 0, kIds[below(std::size(kIds))], 2, little);
      put(made, 2, std::uint32_t(made.size() - 4), 2, little);
      for (std::size_t i = 4; i + 4 <= made.size(); i += 4)
        put(made, i, below(2) == 0 ? nasty() : std::uint32_t(below(12)), 4, little);
      d.insert(d.begin() + std::ptrdiff_t(where), made.begin(), made.end());
      return;
    }
    case 7:  // no end
      d.resize(where + length);
      return;
    default:
      for (std::size_t i = 0; i < 4 && length > 4; ++i)
        d[where + 4 + below(length - 4)] = static_cast<std::uint8_t>(random_());
  }
}

void Mutator::change_bytes(Datagram& d) {
  if (d.empty()) return;
  for (std::size_t n = std::size_t{1} << below(5); n > 0 && !d.empty(); --n) {
    const std::size_t at = below(std::min<std::size_t>(d.size(), below(4) == 0 ? 65'000 : 300));
    switch (below(5)) {
      case 0:
        d[at] = static_cast<std::uint8_t>(random_());
        break;
      case 1:
        d[at] ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 2:
        put(d, at, nasty(), 4, true);
        break;
      case 3:
        d.resize(at);
        break;
      default:
        d.insert(d.begin() + std::ptrdiff_t(at), below(64), static_cast<std::uint8_t>(random_()));
    }
  }
}

void Mutator::change(Part& p) {
  const bool little = (p.flags & 1U) != 0;
  if (below(8) == 0) return change_bytes(p.body);
  if (below(12) == 0) {
    p.flags ^= static_cast<std::uint8_t>(1U << below(4));
    return;
  }
  switch (p.id) {
    case 0x06:
    case 0x07:
    case 0x08:
    case 0x12:
    case 0x13:
      return change_numbers(p, below(6) == 0 ? 0 : 8, p.body.size() / 4);
    case 0x16:
      if (below(4) != 0) return change_numbers(p, 12, 5);
      return change_numbers(p, 0, 8);
    case 0x15: {
      if (p.body.size() < 24 || below(5) == 0) return change_numbers(p, 0, 5);
      std::size_t payload = 20;
      if ((p.flags & 2U) != 0) {
        if (below(3) == 0) return change_list(p.body, 20, little);
        while (payload + 4 <= p.body.size() && get(p.body, payload, 2, little) != 1)
          payload += 4 + get(p.body, payload + 2, 2, little);
        payload += 4;
      }
      if (payload + 4 > p.body.size()) return change_bytes(p.body);
      const std::uint8_t kind = p.body[payload + 1];
      if (kind == 2 || kind == 3) return change_list(p.body, payload + 4, kind == 3);
      if (below(6) == 0) p.body[payload + below(4)] = static_cast<std::uint8_t>(below(12));
      return put(p.body, payload + 4 + 4 * below((p.body.size() - payload) / 4), nasty(), 4, true);
    }
    default:
      if (p.body.size() >= 4) return change_numbers(p, 0, p.body.size() / 4);
      return change_bytes(p.body);
  }
}

/// A submessage of any kind and size.
Mutator::Part Mutator::invent() {
  static constexpr std::uint8_t kIds[] = {0x01, 0x06, 0x07, 0x08, 0x09, 0x0C, 0x0D, 0x0E,
                                          0x0F, 0x12, 0x13, 0x15, 0x16, 0x30, 0x31, 0x32,
                                          0x33, 0x34, 0x80, 0x81, 0x90, 0xFF};
  Part p{kIds[below(std::size(kIds))], static_cast<std::uint8_t>(below(16)), {}};
  p.body.resize(below(10) == 0 ? below(2000) : below(16) * (below(4) == 0 ? 1 : 4));
  for (auto& byte : p.body) byte = static_cast<std::uint8_t>(below(3) == 0 ? random_() : 0);
  return p;
}

Datagram Mutator::next() {
  const Datagram& from = any();
  std::vector<Part> parts = split(from);
  Datagram header(from.begin(), from.begin() + 20);
  if (below(8) == 0) {  // in another's name
    const Datagram& other = any();
    std::copy_n(other.begin() + 6, 14, header.begin() + 6);
  }
  if (below(50) == 0) header[below(20)] = static_cast<std::uint8_t>(random_());
  for (std::size_t n = 1 + below(3); n > 0; --n) {
    const std::size_t at = below(parts.size());
    switch (below(12)) {
      case 0:
        parts.insert(parts.begin() + std::ptrdiff_t(at), invent());
        break;
      case 1: {
        std::vector<Part> others = split(any());
        if (!others.empty())
          parts.insert(parts.begin() + std::ptrdiff_t(at), others[below(others.size())]);
        break;
      }
      case 2:
        if (!parts.empty()) parts.erase(parts.begin() + std::ptrdiff_t(at));
        break;
      case 3:
        if (!parts.empty()) std::swap(parts[at], parts[below(parts.size())]);
        break;
      default:
        if (!parts.empty()) change(parts[at]);
    }
  }
  // To whoever gets it, not to the one it was for.
  for (Part& p : parts)
    if (p.id == 0x0E && below(2) == 0) std::fill(p.body.begin(), p.body.end(), 0);
  Datagram d = join(header, parts);
  if (below(15) == 0) {
    Datagram behind(d.begin() + 20, d.end());
    change_bytes(behind);
    d.resize(20);
    d.insert(d.end(), behind.begin(), behind.end());
  }
  if (d.size() > 65'000) d.resize(65'000);
  return d;
}

}  // namespace crane::test
