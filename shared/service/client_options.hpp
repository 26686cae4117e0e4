#pragma once

#include "config/site_config.hpp"
#include "crane/client/map.hpp"

namespace crane {

/// How the client library joins the network of a site. `identity`: where the site names none.
inline client::Options client_options(const SiteConfig& c, const std::string& identity) {
  client::Options o;
  o.crane = static_cast<std::uint32_t>(c.crane);
  o.domain = static_cast<std::uint32_t>(c.dds.domain);
  o.network = static_cast<client::Options::Network>(c.dds.network);
  o.shared_memory = c.dds.shared_memory;
  o.interfaces = c.dds.interfaces;
  o.servers = c.dds.servers;
  o.peers = c.dds.peers;
  o.security = c.dds.security;
  o.identity = c.dds.identity.empty() ? identity : c.dds.identity;
  o.profile_file = c.dds.profile_file;
  o.profile_name = c.dds.profile_name;
  return o;
}

}  // namespace crane
