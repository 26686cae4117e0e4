// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
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
  std::string crl;     ///< what was revoked; empty: there is no list
  std::string ca_key;  ///< the CA's own key where it should not be; empty: not found
  TimeNs expires = 0;  ///< certificate or CA, whichever comes first
  [[nodiscard]] std::int64_t days_left() const;
};

/// So many days before it expires a certificate is to be renewed.
inline constexpr std::int64_t kRenewDays = 30;

/// Who takes part where.
struct SecurityRole {
  std::string identity;
  std::uint32_t crane = 1, domain = 0;
};

/// Looks in `folder`/crane_<n>/<identity>, then in `folder`/<identity>. Checks what Fast DDS does
/// not, or says so that nobody finds it: that certificate, permissions and governance are of this
/// identity, crane and domain and belong together, that only the CA signed them, that none expired
/// or was revoked, and that nobody else can read the key.
/// Error: Configuration, with what to do.
Result<SecurityFiles> check_security(const std::string& folder, const SecurityRole& role);

/// DDS Security by the settings' folder and identity; nothing when there is none. Warns in the log
/// from kRenewDays before a certificate expires. Returns when it does; 0 without security.
Result<TimeNs> set_security(eprosima::fastdds::dds::DomainParticipantQos& qos,
                            const Settings& settings);

/// Whether the governance, as deploy/security/make writes it, has every message encrypted and lets
/// nobody in without a certificate.
bool all_is_encrypted(const Settings& settings);

}  // namespace crane::dds
