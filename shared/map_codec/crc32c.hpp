// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace crane {

/// CRC-32C (Castagnoli, as in iSCSI, RFC 3720): the check value of every payload on the network.
std::uint32_t crc32c(std::span<const std::uint8_t> bytes);

}  // namespace crane
