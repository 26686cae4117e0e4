// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/result.hpp"
#include "dds/settings.hpp"

namespace eprosima::fastdds::dds {
class DomainParticipantQos;
}

namespace crane::dds {

/// Transport and discovery that lose nothing; measured, see docs/decisions/0003-transport.md.
/// `shm_port`: to listen at, where shared memory is used.
/// Error: Configuration or Resource, e.g. a server whose name has no address.
Result<void> set_network(eprosima::fastdds::dds::DomainParticipantQos& qos,
                         const Settings& settings, std::uint32_t shm_port);

}  // namespace crane::dds
