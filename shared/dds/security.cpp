#include "dds/security.hpp"

#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

#include "base/log.hpp"
#include "base/read_file.hpp"

namespace crane::dds {
namespace {

namespace fs = std::filesystem;

constexpr TimeNs kDay = 86'400 * kNsPerSecond;
constexpr const char* kMakeAgain = "make it again with deploy/security/make";

struct Free {
  void operator()(X509* x) const { X509_free(x); }
  void operator()(EVP_PKEY* k) const { EVP_PKEY_free(k); }
  void operator()(std::FILE* f) const { std::fclose(f); }
};
using Certificate = std::unique_ptr<X509, Free>;
using Key = std::unique_ptr<EVP_PKEY, Free>;

template <class Read>
auto read_pem(const std::string& path, Read read) {
  const std::unique_ptr<std::FILE, Free> file(std::fopen(path.c_str(), "r"));
  return file ? read(file.get(), nullptr, nullptr, nullptr) : nullptr;
}

/// Unix epoch; 0 when it cannot be read.
TimeNs expiry(const X509* certificate) {
  std::tm t{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(certificate), &t) != 1) return 0;
  return TimeNs(timegm(&t)) * kNsPerSecond;
}

Error wrong(const std::string& file, const std::string& what) {
  return {ErrorCode::kConfiguration, file, what, kMakeAgain};
}

}  // namespace

std::int64_t SecurityFiles::days_left() const {
  return (expires - SystemClock().now()) / kDay;
}

Result<SecurityFiles> check_security(const std::string& folder, const std::string& identity) {
  SecurityFiles f;
  f.ca = folder + "/ca.pem";
  f.governance = folder + "/governance.p7s";
  f.certificate = folder + "/" + identity + "/certificate.pem";
  f.key = folder + "/" + identity + "/key.pem";
  f.permissions = folder + "/" + identity + "/permissions.p7s";
  const auto there = is_folder(folder);
  if (!there) return there.error();
  if (!*there)
    return Error{ErrorCode::kConfiguration, "dds.security", "'" + folder + "' is no folder",
                 "make it with deploy/security/make"};
  for (const std::string* file : {&f.ca, &f.governance, &f.certificate, &f.key, &f.permissions})
    if (const std::unique_ptr<std::FILE, Free> open(std::fopen(file->c_str(), "r")); !open)
      return Error{
          ErrorCode::kConfiguration, *file, "cannot be read",
          "make the identity '" + identity + "' with deploy/security/make, readable for this user"};
  const Certificate ca(read_pem(f.ca, PEM_read_X509));
  if (!ca) return wrong(f.ca, "is no certificate");
  const Certificate own(read_pem(f.certificate, PEM_read_X509));
  if (!own) return wrong(f.certificate, "is no certificate");
  const Key key(read_pem(f.key, PEM_read_PrivateKey));
  if (!key) return wrong(f.key, "is no private key");
  if (X509_verify(own.get(), X509_get0_pubkey(ca.get())) != 1)
    return wrong(f.certificate, "is not signed by " + f.ca);
  if (X509_check_private_key(own.get(), key.get()) != 1)
    return wrong(f.key, "is not the key of " + f.certificate);
  f.expires = std::min(expiry(own.get()), expiry(ca.get()));
  const TimeNs left = f.expires - SystemClock().now();
  if (left <= 0)
    return wrong(f.certificate, "or its CA expired " + std::to_string(-left / kDay) + " days ago");
  struct stat mode {};
  if (stat(f.key.c_str(), &mode) == 0 && (mode.st_mode & S_IROTH) != 0)
    return Error{ErrorCode::kConfiguration, f.key, "can be read by everybody",
                 "chmod o-r " + f.key};
  return f;
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
  auto files = check_security(settings.security, settings.identity);
  if (!files) return files.error();
  if (files->days_left() < kRenewDays)
    log_warning(files->certificate + " expires in " + std::to_string(files->days_left()) +
                " days: renew it with deploy/security/make, then restart");
  const auto set = [&qos](const std::string& name, const std::string& value) {
    qos.properties().properties().emplace_back("dds.sec." + name, value);
  };
  set("auth.plugin", "builtin.PKI-DH");
  set("auth.builtin.PKI-DH.identity_ca", "file://" + files->ca);
  set("auth.builtin.PKI-DH.identity_certificate", "file://" + files->certificate);
  set("auth.builtin.PKI-DH.private_key", "file://" + files->key);
  set("access.plugin", "builtin.Access-Permissions");
  set("access.builtin.Access-Permissions.permissions_ca", "file://" + files->ca);
  set("access.builtin.Access-Permissions.governance", "file://" + files->governance);
  set("access.builtin.Access-Permissions.permissions", "file://" + files->permissions);
  set("crypto.plugin", "builtin.AES-GCM-GMAC");
  return files->expires;
}

}  // namespace crane::dds
