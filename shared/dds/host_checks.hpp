// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane::dds {

/// Error: Resource when the kernel grants smaller socket buffers than wanted.
Result<void> check_socket_buffers(std::uint32_t wanted);

/// Error: Resource when no process can join the domain any more: all its UDP ports are taken.
/// Fast DDS itself would join and hear nothing.
Result<void> check_udp_ports(std::uint32_t domain);

/// Error: Configuration when this host has none of these addresses: Fast DDS would join and hear
/// nothing. Of some, those missing are said in the log. An empty list is all that the host has.
Result<void> check_interfaces(const std::vector<std::string>& wanted);

/// The first IPv4 address of "host" or "host:port", the host being a name or an address.
/// Error: Resource when it has none; `key`: where it is configured.
Result<std::string> resolve_ipv4(const std::string& text, const std::string& key);

}  // namespace crane::dds
