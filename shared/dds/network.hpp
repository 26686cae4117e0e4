#pragma once

#include "base/result.hpp"
#include "dds/settings.hpp"

namespace eprosima::fastdds::dds {
class DomainParticipantQos;
}

namespace crane::dds {

/// Transport and discovery that lose nothing; measured, see docs/decisions/0003-transport.md.
/// Error: Configuration or Resource, e.g. a server whose name has no address.
Result<void> set_network(eprosima::fastdds::dds::DomainParticipantQos& qos,
                         const Settings& settings);

}  // namespace crane::dds
