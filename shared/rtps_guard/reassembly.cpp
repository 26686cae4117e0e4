// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/reassembly.hpp"

#include <algorithm>

namespace crane::guard {

Reassembly::Open& Reassembly::open(const Prefix& from, const Fragment& fragment) {
  const auto known = std::find_if(open_.begin(), open_.end(), [&](const Open& o) {
    return o.from == from && o.first_seen.sample == fragment.sample;
  });
  if (known != open_.end()) return *known;
  const auto is_its = [&](const Open& o) { return o.from == from; };
  if (std::size_t(std::count_if(open_.begin(), open_.end(), is_its)) >= kOpenOfOne)
    open_.erase(std::find_if(open_.begin(), open_.end(), is_its));
  if (open_.size() >= kOpen) open_.pop_front();
  const std::size_t parts = (fragment.sample_bytes - 1) / fragment.fragment_bytes + 1;
  open_.push_back({from, fragment, std::vector<std::uint8_t>(fragment.sample_bytes),
                   std::vector<bool>(parts, false), parts});
  return open_.back();
}

Refusal Reassembly::add(const Prefix& from, const Fragment& fragment, Bytes bytes, Bytes& whole) {
  whole = {};
  if (fragment.sample_bytes > kLargest) return Refusal::kSampleSize;
  Open& sample = open(from, fragment);
  if (sample.first_seen.sample_bytes != fragment.sample_bytes ||
      sample.first_seen.fragment_bytes != fragment.fragment_bytes)
    return Refusal::kFragmentsDisagree;
  for (std::size_t i = 0; i < fragment.count; ++i) {
    const std::size_t part = fragment.first - 1 + i, at = part * fragment.fragment_bytes;
    if (sample.there[part]) continue;
    const std::size_t size =
        std::min<std::size_t>(fragment.fragment_bytes, fragment.sample_bytes - at);
    std::copy_n(bytes.begin() + std::ptrdiff_t(i * fragment.fragment_bytes), size,
                sample.bytes.begin() + std::ptrdiff_t(at));
    sample.there[part] = true;
    --sample.missing;
  }
  if (sample.missing > 0) return Refusal::kNone;
  whole_ = std::move(sample.bytes);
  open_.remove_if([&sample](const Open& o) { return &o == &sample; });
  whole = whole_;
  return Refusal::kNone;
}

std::vector<std::uint8_t> data_message(Bytes header, const Prefix& source, std::uint32_t reader,
                                       std::uint32_t writer, std::uint64_t number, Bytes payload) {
  constexpr std::size_t kBeforePayload = 20;
  constexpr std::uint8_t kLittleEndian = 1, kHasData = 4;
  constexpr std::size_t kHeader = 20;
  std::vector<std::uint8_t> out;
  out.reserve(kHeader + 4 + kBeforePayload + payload.size());
  const auto copy = [&out](Bytes bytes) {
    for (const std::uint8_t byte : bytes) out.push_back(byte);
  };
  const auto little = [&out](std::uint32_t value, unsigned bytes) {
    for (unsigned i = 0; i < bytes; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  };
  const auto big = [&out](std::uint32_t value) {
    for (unsigned i = 0; i < 4; ++i)
      out.push_back(static_cast<std::uint8_t>(value >> (24 - 8 * i)));
  };
  copy(header.first(8));
  copy(source);
  out.push_back(kData);
  out.push_back(kLittleEndian | kHasData);
  little(static_cast<std::uint32_t>(kBeforePayload + payload.size()), 2);
  little(0, 2);
  little(16, 2);  // to where inline QoS would be
  big(reader);
  big(writer);
  little(static_cast<std::uint32_t>(number >> 32U), 4);
  little(static_cast<std::uint32_t>(number), 4);
  copy(payload);
  return out;
}

}  // namespace crane::guard
