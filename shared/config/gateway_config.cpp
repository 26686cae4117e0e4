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
          "is not of the loopback, unless tls_client_ca is set; http.hosts are the names it may be "
          "asked by"},
         c.token_file);
  v.text({"tls_certificate",
          "PEM file: page and API by https and wss alone; its own certificate first, then those "
          "that lead to a known CA; empty: in the clear"},
         c.tls_certificate);
  v.text({"tls_key",
          "PEM file without password: the key of tls_certificate; nobody but its owner "
          "may read it"},
         c.tls_key);
  v.text({"tls_client_ca",
          "PEM file: who connects has to have a certificate of this CA; empty: needs none"},
         c.tls_client_ca);
  v.integer({"pages", "that may look on at a time"}, c.pages, {1, 1000});
  v.texts({"origins",
           "pages of others that may look on by Foxglove's protocol, as their browser says it: "
           "https://app.foxglove.dev; programs that are no page need none"},
          c.origins);
  YamlReader* y = v.reading();
  if (y == nullptr) return;
  if (c.tls_certificate.empty() != c.tls_key.empty())
    y->problem(c.tls_key.empty() ? "tls_certificate" : "tls_key",
               "is of no use alone: tls_certificate and tls_key are set both, or neither");
  if (!c.tls_client_ca.empty() && !c.tls())
    y->problem("tls_client_ca", "needs tls_certificate and tls_key");
  const bool loopback =
      c.address.starts_with("127.") || c.address == "::1" || c.address == "localhost";
  if (!loopback && c.token_file.empty() && c.tls_client_ca.empty())
    y->problem(
        "address",
        "is not of the loopback: others need a token, name its token_file, or a certificate, "
        "name tls_client_ca");
}

}  // namespace crane
