// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "map_codec/compression.hpp"

namespace crane {

/// Little-endian, whatever the host.
inline void put_le(Bytes& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// The caller has checked that `at + bytes` lies inside.
inline std::uint64_t get_le(std::span<const std::uint8_t> in, std::size_t at, int bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < bytes; ++i)
    value |= std::uint64_t(in[at + static_cast<std::size_t>(i)]) << (8 * i);
  return value;
}

}  // namespace crane
