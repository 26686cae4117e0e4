// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/result.hpp"

namespace crane {

using Bytes = std::vector<std::uint8_t>;

/// zstd at a level (1 fast .. 19 small).
Bytes compress(std::span<const std::uint8_t> bytes, int level);

/// Error: BadData when it is no single zstd frame that says its size, or says more than max_bytes.
/// No memory is taken before that check.
Result<Bytes> decompress(std::span<const std::uint8_t> bytes, std::size_t max_bytes);

}  // namespace crane
