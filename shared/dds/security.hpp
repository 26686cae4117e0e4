#pragma once

#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "dds/settings.hpp"

namespace eprosima::fastdds::dds {
class DomainParticipantQos;
}

namespace crane::dds {

/// An identity of a folder made by deploy/security/make: who we are on the network, and may do.
struct SecurityFiles {
  std::string ca, governance, certificate, key, permissions;
  TimeNs expires = 0;  ///< certificate or CA, whichever comes first
  [[nodiscard]] std::int64_t days_left() const;
};

/// So many days before it expires a certificate is to be renewed.
inline constexpr std::int64_t kRenewDays = 30;

/// Error: Configuration when a file is missing, is not what it should be, is not signed by the
/// folder's CA, or has expired; with what to do.
Result<SecurityFiles> check_security(const std::string& folder, const std::string& identity);

/// DDS Security by the settings' folder and identity; nothing when there is none. Warns in the log
/// from kRenewDays before a certificate expires. Returns when it does; 0 without security.
Result<TimeNs> set_security(eprosima::fastdds::dds::DomainParticipantQos& qos,
                            const Settings& settings);

/// Whether the governance, as deploy/security/make writes it, has every message encrypted and lets
/// nobody in without a certificate.
bool all_is_encrypted(const Settings& settings);

}  // namespace crane::dds
