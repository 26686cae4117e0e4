// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/site_config.hpp"
#include "crane/client/map.hpp"

namespace crane {

/// How the client library joins the network of a site. `identity`: where the site names none.
inline client::Options client_options(const SiteConfig& c, const std::string& identity) {
  client::Options o;
  static_cast<NetworkSettings&>(o) = c.dds;
  o.crane = static_cast<std::uint32_t>(c.crane);
  if (o.identity.empty()) o.identity = identity;
  return o;
}

/// And within a participant that is there: not a second time.
inline client::MapOptions map_options(const SiteConfig& c) {
  client::MapOptions o;
  o.crane = static_cast<std::uint32_t>(c.crane);
  return o;
}

}  // namespace crane
