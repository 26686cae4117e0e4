// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/plc_telegram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace crane {
namespace {

/// So many telegrams with one heartbeat, and the PLC stands still: it may send faster than it
/// counts.
constexpr int kSame = 10;

std::uint64_t unsigned_at(std::span<const std::uint8_t> bytes, bool little) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    value = value << 8U | bytes[little ? bytes.size() - 1 - i : i];
  return value;
}

}  // namespace

double plc_number(std::span<const std::uint8_t> bytes, PlcNumber type, bool little) {
  const std::uint64_t raw = unsigned_at(bytes, little);
  switch (type) {
    case PlcNumber::kInt16:
      return static_cast<std::int16_t>(raw);
    case PlcNumber::kUint16:
    case PlcNumber::kUint32:
      return double(raw);
    case PlcNumber::kInt32:
      return static_cast<std::int32_t>(raw);
    case PlcNumber::kFloat32: {
      const auto value = double(std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
      return std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
    }
    case PlcNumber::kFloat64: {
      const auto value = std::bit_cast<double>(raw);
      return std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return std::numeric_limits<double>::quiet_NaN();
}

void PlcTelegram::take(std::span<const std::uint8_t> bytes, DeviceTalk& out) {
  const auto length = static_cast<std::size_t>(config_.length);
  if (config_.datagrams) {
    if (bytes.size() == length)
      understand(bytes, out);
    else
      ++damaged_;
    return;
  }
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  std::size_t from = 0;
  for (; from + length <= bytes_.size(); from += length)
    understand(std::span(bytes_).subspan(from, length), out);
  bytes_.erase(bytes_.begin(), bytes_.begin() + std::ptrdiff_t(from));
}

void PlcTelegram::understand(std::span<const std::uint8_t> telegram, DeviceTalk& out) {
  using Kind = DeviceSaid::Kind;
  const auto field = [&](int offset, PlcNumber type) {
    return telegram.subspan(static_cast<std::size_t>(offset), plc_bytes(type));
  };
  const bool little = config_.little_endian;
  if (config_.heartbeat_offset >= 0) {
    const std::uint64_t beat =
        unsigned_at(field(config_.heartbeat_offset, config_.heartbeat_type), little);
    same_ = heard_ && beat == heartbeat_ ? std::min(same_ + 1, kSame) : 0;
    heard_ = true;
    heartbeat_ = beat;
    if (same_ >= kSame) {
      out.push_back({Kind::kFault, 0, "the PLC's heartbeat stands still", telegram.size()});
      return;
    }
  }
  const double value =
      plc_number(field(config_.value_offset, config_.value_type), config_.value_type, little);
  if (std::isnan(value))
    out.push_back({Kind::kNoDistance, 0, "the PLC's number is none", telegram.size()});
  else
    out.push_back({Kind::kDistance, value * config_.unit_m, "", telegram.size()});
}

}  // namespace crane
