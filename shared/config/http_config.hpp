// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace crane {

class KeyVisitor;

/// Section `http`.
struct HttpConfig {
  std::string address = "127.0.0.1";
  int port = 9460;
  std::vector<std::string> hosts;
};
void keys(KeyVisitor& v, HttpConfig& c);

}  // namespace crane
