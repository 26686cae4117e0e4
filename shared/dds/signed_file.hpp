// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openssl/x509.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"

namespace crane::dds {

/// What OpenSSL makes, freed as it wants it.
struct OpensslFree {
  void operator()(X509* x) const { X509_free(x); }
  void operator()(EVP_PKEY* k) const { EVP_PKEY_free(k); }
  void operator()(X509_CRL* c) const { X509_CRL_free(c); }
};
using Certificate = std::unique_ptr<X509, OpensslFree>;
using PrivateKey = std::unique_ptr<EVP_PKEY, OpensslFree>;
using Revoked = std::unique_ptr<X509_CRL, OpensslFree>;

/// Nothing when the file cannot be read or is none.
Certificate read_certificate(const std::string& path);
PrivateKey read_private_key(const std::string& path);
Revoked read_revoked(const std::string& path);

/// As permissions write it: "CN=mapper,OU=crane_1,O=cranemap".
std::string subject_of(const X509* certificate);
/// Unix epoch; 0 when it cannot be read.
TimeNs expiry(const X509* certificate);

/// The text of an S/MIME file, if it was signed with the key of `ca` itself. Fast DDS also takes
/// what was signed by any certificate that the CA issued.
std::optional<std::string> text_signed_by(X509* ca, const std::string& path);

/// What stands between <tag> and </tag>, each time.
std::vector<std::string> values_of(const std::string& xml, const std::string& tag);
/// Whether the <id> and <id_range> of `xml` have this domain.
bool has_domain(const std::string& xml, std::uint32_t domain);

}  // namespace crane::dds
