// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace crane {

class KeyVisitor;

/// Section `gateway`.
struct GatewayConfig {
  std::string address = "127.0.0.1";
  int port = 9480;
  std::string token_file;
  std::string tls_certificate, tls_key, tls_client_ca;
  std::vector<std::string> origins;
  int pages = 64;

  [[nodiscard]] bool tls() const { return !tls_certificate.empty(); }
};
void keys(KeyVisitor& v, GatewayConfig& c);

}  // namespace crane
