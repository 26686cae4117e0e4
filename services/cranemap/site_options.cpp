// SPDX-License-Identifier: Apache-2.0
#include "site_options.hpp"

#include <CLI/CLI.hpp>

#include "service/key_option.hpp"

namespace crane {

void add_site_options(CLI::App& command, SiteOptions& o) {
  command.add_option("--config", o.config, "Site configuration (YAML)")->check(CLI::ExistingFile);
  command.add_option("--domain", o.domain, "DDS domain, over that of --config")
      ->check(within<CLI::Range>("dds.domain", 0));
  command.add_option("--crane", o.crane, "Crane number, over that of --config")
      ->check(within<CLI::Range>("crane", 0));
}

Result<SiteConfig> read_site(const SiteOptions& o) {
  SiteConfig config;
  if (!o.config.empty()) {
    auto read = read_site_config(o.config);
    if (!read) return read.error();
    config = *read;
  }
  if (o.domain >= 0) config.dds.domain = static_cast<std::uint32_t>(o.domain);
  if (o.crane >= 1) config.crane = o.crane;
  return config;
}

}  // namespace crane
