// SPDX-License-Identifier: Apache-2.0
#include "dds/security.hpp"

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fstream>
#include <iterator>

#include "base/log.hpp"

namespace crane::dds {

std::int64_t SecurityFiles::days_left() const {
  return (expires - SystemClock().now()) / (86'400 * kNsPerSecond);
}

bool all_is_encrypted(const Settings& settings) {
  if (settings.security.empty()) return false;
  std::ifstream file(settings.security + "/governance.p7s");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto says = [&text](const char* what) { return text.find(what) != std::string::npos; };
  return says("<rtps_protection_kind>ENCRYPT</rtps_protection_kind>") &&
         says("<allow_unauthenticated_participants>false</allow_unauthenticated_participants>");
}

Result<TimeNs> set_security(eprosima::fastdds::dds::DomainParticipantQos& qos,
                            const Settings& settings) {
  if (settings.security.empty()) return TimeNs{0};
  auto files =
      check_security(settings.security, {settings.identity, settings.crane, settings.domain});
  if (!files) return files.error();
  if (files->days_left() < kRenewDays)
    log_warning(files->certificate + " expires in " + std::to_string(files->days_left()) +
                " days: renew it with deploy/security/make, then restart");
  if (!files->ca_key.empty())
    log_warning(files->ca_key + " is the plant CA's key: who reads it is everybody. Keep it off " +
                "the machines that services run on");
  const auto set = [&qos](const std::string& name, const std::string& value) {
    qos.properties().properties().emplace_back("dds.sec." + name, value);
  };
  set("auth.plugin", "builtin.PKI-DH");
  set("auth.builtin.PKI-DH.identity_ca", "file://" + files->ca);
  set("auth.builtin.PKI-DH.identity_certificate", "file://" + files->certificate);
  set("auth.builtin.PKI-DH.private_key", "file://" + files->key);
  if (!files->crl.empty()) set("auth.builtin.PKI-DH.identity_crl", "file://" + files->crl);
  set("access.plugin", "builtin.Access-Permissions");
  set("access.builtin.Access-Permissions.permissions_ca", "file://" + files->ca);
  set("access.builtin.Access-Permissions.governance", "file://" + files->governance);
  set("access.builtin.Access-Permissions.permissions", "file://" + files->permissions);
  set("crypto.plugin", "builtin.AES-GCM-GMAC");
  return files->expires;
}

}  // namespace crane::dds
