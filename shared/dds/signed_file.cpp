// SPDX-License-Identifier: Apache-2.0
#include "dds/signed_file.hpp"

#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/pkcs7.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace crane::dds {
namespace {

struct Free {
  void operator()(BIO* b) const { BIO_free_all(b); }
  void operator()(PKCS7* p) const { PKCS7_free(p); }
  void operator()(X509_STORE* s) const { X509_STORE_free(s); }
  void operator()(STACK_OF(X509) * s) const { sk_X509_free(s); }
  void operator()(std::FILE* f) const { std::fclose(f); }
};

template <class Read>
auto read_pem(const std::string& path, Read read) {
  const std::unique_ptr<std::FILE, Free> file(std::fopen(path.c_str(), "r"));
  return file ? read(file.get(), nullptr, nullptr, nullptr) : nullptr;
}

}  // namespace

Certificate read_certificate(const std::string& path) {
  return Certificate(read_pem(path, PEM_read_X509));
}

PrivateKey read_private_key(const std::string& path) {
  // Without the question for a pass phrase, which nobody would answer.
  const std::unique_ptr<std::FILE, Free> file(std::fopen(path.c_str(), "r"));
  char none[] = "";
  return PrivateKey(file ? PEM_read_PrivateKey(file.get(), nullptr, nullptr, none) : nullptr);
}

Revoked read_revoked(const std::string& path) {
  return Revoked(read_pem(path, PEM_read_X509_CRL));
}

std::string subject_of(const X509* certificate) {
  const std::unique_ptr<BIO, Free> out(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(out.get(), X509_get_subject_name(certificate), 0, XN_FLAG_RFC2253);
  char* text = nullptr;
  const long size = BIO_get_mem_data(out.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

TimeNs expiry(const X509* certificate) {
  std::tm t{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(certificate), &t) != 1) return 0;
  return TimeNs(timegm(&t)) * kNsPerSecond;
}

std::optional<std::string> text_signed_by(X509* ca, const std::string& path) {
  const std::unique_ptr<BIO, Free> in(BIO_new_file(path.c_str(), "r"));
  if (!in) return std::nullopt;
  BIO* content = nullptr;
  const std::unique_ptr<PKCS7, Free> message(SMIME_read_PKCS7(in.get(), &content));
  const std::unique_ptr<BIO, Free> data(content);
  const std::unique_ptr<BIO, Free> out(BIO_new(BIO_s_mem()));
  const std::unique_ptr<X509_STORE, Free> store(X509_STORE_new());
  if (!message || X509_STORE_add_cert(store.get(), ca) != 1 ||
      PKCS7_verify(message.get(), nullptr, store.get(), data.get(), out.get(), PKCS7_TEXT) != 1)
    return std::nullopt;
  const std::unique_ptr<STACK_OF(X509), Free> signers(
      PKCS7_get0_signers(message.get(), nullptr, 0));
  if (!signers || sk_X509_num(signers.get()) != 1 ||
      X509_cmp(sk_X509_value(signers.get(), 0), ca) != 0)
    return std::nullopt;
  char* text = nullptr;
  const long size = BIO_get_mem_data(out.get(), &text);
  return std::string(text, static_cast<std::size_t>(size));
}

std::vector<std::string> values_of(const std::string& xml, const std::string& tag) {
  std::vector<std::string> out;
  const std::string begin = "<" + tag + ">";
  for (std::size_t at = 0; (at = xml.find(begin, at)) != std::string::npos;) {
    at += begin.size();
    const std::size_t end = xml.find("</" + tag + ">", at);
    if (end == std::string::npos) break;
    out.push_back(xml.substr(at, end - at));
  }
  return out;
}

bool has_domain(const std::string& xml, std::uint32_t domain) {
  const auto number = [](const std::string& text) {
    return std::strtoul(text.c_str(), nullptr, 10);
  };
  for (const std::string& domains : values_of(xml, "domains")) {
    for (const std::string& id : values_of(domains, "id"))
      if (number(id) == domain) return true;
    for (const std::string& range : values_of(domains, "id_range")) {
      const auto min = values_of(range, "min");
      const auto max = values_of(range, "max");
      if ((min.empty() || number(min[0]) <= domain) && (max.empty() || domain <= number(max[0])))
        return true;
    }
  }
  return false;
}

}  // namespace crane::dds
