// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "build.hpp"

namespace crane::test {

/// The same message with all numbers of RTPS big-endian: submessages, inline QoS, and parameter
/// lists of discovery. Users' samples, which say their byte order themselves, stay. For sound
/// little-endian messages; of others any bytes.
Datagram big_endian(const Datagram& message);

/// As another vendor signs it: header and, in its announcement, parameter.
Datagram of_vendor(const Datagram& message, std::uint16_t vendor);

/// For each message one that says the same in another way: big-endian, as other vendors do, of
/// another RTPS version, with INFO_SRC, INFO_REPLY, INFO_DST or PAD before it. To mutate as well.
std::vector<Datagram> variants(const std::vector<Datagram>& messages, std::uint32_t seed);

}  // namespace crane::test
