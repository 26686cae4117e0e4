// SPDX-License-Identifier: Apache-2.0
#include "config/gateway_config.hpp"

#include "config/key.hpp"
#include "config/yaml_reader.hpp"

namespace crane {

void keys(KeyVisitor& v, GatewayConfig& c) {
  v.text({"address", "address of this host where page and API are served"}, c.address);
  v.integer({"port", "of the same; 0: any that is free, the log says which"}, c.port, {0, 65'535});
  v.text({"token_file",
          "file whose first line everybody has to show, 16 letters or more; needed where address "
          "is not of the loopback; http.hosts are the names it may be asked by"},
         c.token_file);
  v.integer({"pages", "that may look on at a time"}, c.pages, {1, 1000});
  YamlReader* y = v.reading();
  const bool loopback =
      c.address.starts_with("127.") || c.address == "::1" || c.address == "localhost";
  if (y != nullptr && !loopback && c.token_file.empty())
    y->problem("address", "is not of the loopback: others need a token, name its token_file");
}

}  // namespace crane
