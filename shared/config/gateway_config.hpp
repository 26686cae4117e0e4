// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace crane {

class KeyVisitor;

/// Section `gateway`.
struct GatewayConfig {
  std::string address = "127.0.0.1";
  int port = 9480;
  std::string token_file;
  int pages = 64;
};
void keys(KeyVisitor& v, GatewayConfig& c);

}  // namespace crane
