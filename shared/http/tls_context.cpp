// SPDX-License-Identifier: Apache-2.0
#include "http/tls_context.hpp"

#include <openssl/ssl.h>
#include <sys/stat.h>

#include <boost/asio/buffer.hpp>
#include <cstdio>

#include "base/read_file.hpp"

namespace crane::http {
namespace {

namespace ssl = boost::asio::ssl;
using Failure = boost::system::error_code;

constexpr std::uint64_t kMostBytes = 1U << 20U;

Error wrong(const std::string& file, const std::string& what, const std::string& todo) {
  return {ErrorCode::kConfiguration, file, what, todo};
}

Result<std::string> read_pem(const std::string& file) {
  auto text = read_file(file, kMostBytes);
  if (!text) return Error{ErrorCode::kConfiguration, file, text.error().what, text.error().todo};
  return text;
}

/// Whoever reads the key can pass for this server.
Result<void> check_key_mode(const std::string& file) {
  struct stat is {};
  if (stat(file.c_str(), &is) != 0) return {};  // said by who reads it
  if ((is.st_mode & 077U) == 0) return {};
  char mode[8];
  std::snprintf(mode, sizeof mode, "%04o", is.st_mode & 07777U);
  return wrong(file, std::string("is open to others than its owner (mode ") + mode + ")",
               "chmod 600 " + file);
}

Result<void> check_dates(ssl::context& context, const std::string& file) {
  const X509* own = SSL_CTX_get0_certificate(context.native_handle());
  if (own == nullptr) return {};
  if (X509_cmp_current_time(X509_get0_notAfter(own)) < 0)
    return wrong(file, "has expired", "renew it: no browser would accept it");
  if (X509_cmp_current_time(X509_get0_notBefore(own)) > 0)
    return wrong(file, "is not valid yet", "is this host's clock right?");
  return {};
}

Result<void> load(ssl::context& context, const TlsFiles& files) {
  if (auto open = check_key_mode(files.key); !open) return open;
  const auto certificate = read_pem(files.certificate);
  if (!certificate) return certificate.error();
  const auto key = read_pem(files.key);
  if (!key) return key.error();
  Failure failed;
  context.use_certificate_chain(boost::asio::buffer(*certificate), failed);
  if (failed)
    return wrong(files.certificate, "is no certificate: " + failed.message(),
                 "a PEM file is needed, its own certificate first");
  context.use_private_key(boost::asio::buffer(*key), ssl::context::pem, failed);
  if (failed)
    return wrong(files.key,
                 "is no key, is kept by a password, or is not that of " + files.certificate + ": " +
                     failed.message(),
                 "a PEM file without password is needed");
  if (SSL_CTX_check_private_key(context.native_handle()) != 1)
    return wrong(files.key, "is not the key of " + files.certificate, "copy both from one place");
  if (auto dates = check_dates(context, files.certificate); !dates) return dates;
  if (files.client_ca.empty()) return {};
  const auto ca = read_pem(files.client_ca);
  if (!ca) return ca.error();
  context.add_certificate_authority(boost::asio::buffer(*ca), failed);
  if (failed)
    return wrong(files.client_ca, "is no CA's certificate: " + failed.message(),
                 "a PEM file is needed");
  context.set_verify_mode(ssl::verify_peer | ssl::verify_fail_if_no_peer_cert);
  return {};
}

/// A password could not be typed in: not asked for.
int no_password(char*, int, int, void*) {
  return 0;
}

}  // namespace

Result<std::unique_ptr<ssl::context>> make_tls_context(const TlsFiles& files) {
  try {
    auto context = std::make_unique<ssl::context>(ssl::context::tls_server);
    SSL_CTX* raw = context->native_handle();
    SSL_CTX_set_min_proto_version(raw, TLS1_2_VERSION);
    SSL_CTX_set_options(raw, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_TICKET | SSL_OP_NO_COMPRESSION |
                                 SSL_OP_CIPHER_SERVER_PREFERENCE);
    SSL_CTX_set_session_cache_mode(raw, SSL_SESS_CACHE_OFF);
    SSL_CTX_set_num_tickets(raw, 0);
    SSL_CTX_set_default_passwd_cb(raw, no_password);
    if (auto loaded = load(*context, files); !loaded) return loaded.error();
    return context;
  } catch (const std::exception& e) {
    return Error{ErrorCode::kResource, "TLS", e.what(), ""};
  }
}

}  // namespace crane::http
