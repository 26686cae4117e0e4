// SPDX-License-Identifier: Apache-2.0
#include <fnmatch.h>
#include <openssl/x509v3.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>

#include "base/read_file.hpp"
#include "dds/security.hpp"
#include "dds/signed_file.hpp"

namespace crane::dds {
namespace {

namespace fs = std::filesystem;

constexpr TimeNs kDay = 86'400 * kNsPerSecond;
constexpr const char* kMakeAgain = "make it again with deploy/security/make";

Error wrong(const std::string& file, const std::string& what,
            const std::string& todo = kMakeAgain) {
  return {ErrorCode::kConfiguration, file, what, todo};
}

std::string user_name(uid_t user) {
  const passwd* entry = getpwuid(user);
  return entry != nullptr ? entry->pw_name : std::to_string(user);
}

Error of_another(const std::string& path, uid_t owner) {
  const std::string us = user_name(geteuid());
  return wrong(path, "belongs to " + user_name(owner) + ", and this runs as " + us,
               "chown -R " + us + " " + path);
}

/// Whoever reads a key is that identity. `home`: the folder that it is in.
Result<void> check_key_file(const std::string& home, const std::string& key) {
  struct stat is {};
  if (stat(key.c_str(), &is) != 0) {
    if (errno == EACCES && stat(home.c_str(), &is) == 0) return of_another(home, is.st_uid);
    return wrong(key, "cannot be read", "make the identity with deploy/security/make");
  }
  const uid_t us = geteuid();
  if (is.st_uid != us && us != 0) return of_another(key, is.st_uid);
  if ((is.st_mode & 077U) != 0) {
    char mode[8];
    std::snprintf(mode, sizeof mode, "%04o", is.st_mode & 07777U);
    return wrong(key, std::string("is open to others than its owner (mode ") + mode + ")",
                 "chmod 600 " + key);
  }
  return {};
}

Result<void> check_certificate(const SecurityFiles& f, X509* own, X509* ca,
                               const SecurityRole& role) {
  if (X509_verify(own, X509_get0_pubkey(ca)) != 1)
    return wrong(f.certificate, "is not signed by " + f.ca);
  const std::string unit = "crane_" + std::to_string(role.crane);
  const std::string subject = subject_of(own);
  const std::string of_crane = "CN=" + role.identity + ",OU=" + unit + ",";
  const std::string of_plant = "CN=" + role.identity + ",OU=plant,";
  if (!subject.starts_with(of_crane) && !subject.starts_with(of_plant))
    return wrong(f.certificate, "is of '" + subject + "', not of " + role.identity + " of " + unit,
                 "use this crane's folder, or " + std::string(kMakeAgain) + " --crane " +
                     std::to_string(role.crane));
  if (X509_check_purpose(own, X509_PURPOSE_SMIME_SIGN, 0) == 1)
    return wrong(f.certificate, "could sign permissions of its own: an older make's");
  return {};
}

Result<void> check_permissions(const SecurityFiles& f, const X509* own, X509* ca,
                               const SecurityRole& role) {
  const auto text = text_signed_by(ca, f.permissions);
  if (!text)
    return wrong(f.permissions, "was not signed by the key of " + f.ca + ", or changed since");
  const std::string unit = "crane_" + std::to_string(role.crane);
  const std::string subject = subject_of(own);
  std::size_t at = text->find("<grant ");
  for (std::string grant; at != std::string::npos;) {
    const std::size_t next = text->find("<grant ", at + 1);
    grant = text->substr(at, next - at);
    at = next;
    const auto names = values_of(grant, "subject_name");
    if (names.size() != 1 || names[0] != subject) continue;
    if (!has_domain(grant, role.domain))
      return wrong(f.permissions, "are not for domain " + std::to_string(role.domain),
                   std::string(kMakeAgain) + " --domain " + std::to_string(role.domain));
    const auto partitions = values_of(grant, "partition");
    if (std::none_of(partitions.begin(), partitions.end(), [&unit](const std::string& p) {
          return fnmatch(p.c_str(), unit.c_str(), 0) == 0;
        }))
      return wrong(f.permissions, "are not for crane " + std::to_string(role.crane),
                   std::string(kMakeAgain) + " --crane " + std::to_string(role.crane));
    return {};
  }
  return wrong(f.permissions,
               "are of another identity than " + f.certificate + " ('" + subject + "')",
               "copy both from the same folder");
}

Result<void> check_governance(const SecurityFiles& f, X509* ca, const SecurityRole& role) {
  const auto text = text_signed_by(ca, f.governance);
  if (!text)
    return wrong(f.governance, "was not signed by the key of " + f.ca + ", or changed since");
  if (!has_domain(*text, role.domain))
    return wrong(f.governance, "is not for domain " + std::to_string(role.domain),
                 std::string(kMakeAgain) + " --domain " + std::to_string(role.domain));
  // The plant's cranes, as make lists them; who makes a governance of their own need not.
  const std::size_t list = text->find("<!-- cranemap:");
  if (list == std::string::npos) return {};
  const std::string cranes = text->substr(list, text->find("-->", list) - list);
  if (cranes.find(" crane_" + std::to_string(role.crane) + " ") == std::string::npos)
    return wrong(f.governance, "knows no crane " + std::to_string(role.crane),
                 std::string(kMakeAgain) + " --crane " + std::to_string(role.crane));
  return {};
}

Result<void> check_revoked(const SecurityFiles& f, X509* own, X509* ca) {
  if (f.crl.empty()) return {};
  const Revoked crl = read_revoked(f.crl);
  if (!crl || X509_CRL_verify(crl.get(), X509_get0_pubkey(ca)) != 1)
    return wrong(f.crl, "is no revocation list of " + f.ca);
  const ASN1_TIME* until = X509_CRL_get0_nextUpdate(crl.get());
  if (until != nullptr && X509_cmp_current_time(until) < 0)
    return wrong(f.crl, "has expired, and with it every certificate",
                 "deploy/security/make --revoke makes a new one");
  X509_REVOKED* entry = nullptr;
  if (X509_CRL_get0_by_cert(crl.get(), &entry, own) == 1)
    return wrong(f.certificate, "was revoked");
  return {};
}

/// The CA's own key, wherever it lies in the folder or in its private/.
std::string find_ca_key(const std::string& folder, const X509* ca) {
  for (const std::string& where : {folder, folder + "/private"}) {
    std::error_code failed;
    for (fs::directory_iterator entry(where, failed), end; !failed && entry != end;
         entry.increment(failed)) {
      const std::string extension = entry->path().extension();
      if (extension != ".key" && extension != ".pem") continue;
      if (const PrivateKey key = read_private_key(entry->path());
          key && X509_check_private_key(ca, key.get()) == 1)
        return entry->path();
    }
  }
  return "";
}

}  // namespace

Result<SecurityFiles> check_security(const std::string& folder, const SecurityRole& role) {
  const auto there = is_folder(folder);
  if (!there) return there.error();
  if (!*there)
    return wrong("dds.security", "'" + folder + "' is no folder",
                 "make it with deploy/security/make");
  std::string home = folder + "/crane_" + std::to_string(role.crane) + "/" + role.identity;
  const auto of_crane = is_folder(home);
  if (!of_crane) return of_crane.error();
  if (!*of_crane) home = folder + "/" + role.identity;
  SecurityFiles f;
  f.ca = folder + "/ca.pem";
  f.governance = folder + "/governance.p7s";
  f.certificate = home + "/certificate.pem";
  f.key = home + "/key.pem";
  f.permissions = home + "/permissions.p7s";
  const auto list = is_there(folder + "/crl.pem");
  if (!list) return list.error();
  if (*list) f.crl = folder + "/crl.pem";
  if (auto safe = check_key_file(home, f.key); !safe) return safe.error();
  for (const std::string* file : {&f.ca, &f.governance, &f.certificate, &f.key, &f.permissions})
    if (access(file->c_str(), R_OK) != 0)
      return wrong(*file, "cannot be read",
                   "make the identity '" + role.identity +
                       "' with deploy/security/make, readable for " + user_name(geteuid()));
  const Certificate ca = read_certificate(f.ca);
  if (!ca) return wrong(f.ca, "is no certificate");
  const Certificate own = read_certificate(f.certificate);
  if (!own) return wrong(f.certificate, "is no certificate");
  const PrivateKey key = read_private_key(f.key);
  if (!key) return wrong(f.key, "is no private key");
  if (X509_check_private_key(own.get(), key.get()) != 1)
    return wrong(f.key, "is not the key of " + f.certificate);
  f.expires = std::min(expiry(own.get()), expiry(ca.get()));
  if (const TimeNs left = f.expires - SystemClock().now(); left <= 0)
    return wrong(f.certificate, "or its CA expired " + std::to_string(-left / kDay) + " days ago");
  for (const Result<void>& checked :
       {check_certificate(f, own.get(), ca.get(), role),
        check_permissions(f, own.get(), ca.get(), role), check_governance(f, ca.get(), role),
        check_revoked(f, own.get(), ca.get())})
    if (!checked) return checked.error();
  f.ca_key = find_ca_key(folder, ca.get());
  return f;
}

}  // namespace crane::dds
