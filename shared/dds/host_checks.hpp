#pragma once

#include <cstdint>

#include "base/result.hpp"

namespace crane::dds {

/// Error: Resource when the kernel grants smaller socket buffers than wanted.
Result<void> check_socket_buffers(std::uint32_t wanted);

/// Error: Resource when no process can join the domain any more: all its UDP ports are taken.
/// Fast DDS itself would join and hear nothing.
Result<void> check_udp_ports(std::uint32_t domain);

}  // namespace crane::dds
