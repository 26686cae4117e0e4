#pragma once

#include "config/site_config.hpp"
#include "crane/client/map.hpp"

namespace crane {

/// How the client library joins the network of a site.
inline client::Options client_options(const SiteConfig& c) {
  client::Options o;
  o.crane = static_cast<std::uint32_t>(c.crane);
  o.domain = static_cast<std::uint32_t>(c.dds.domain);
  o.udp_only = c.dds.udp_only;
  o.interfaces = c.dds.interfaces;
  o.profile_file = c.dds.profile_file;
  o.profile_name = c.dds.profile_name;
  return o;
}

}  // namespace crane
