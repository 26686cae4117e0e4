// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/site_config.hpp"

namespace CLI {
class App;
}

namespace crane {

/// Which crane a command means: its configuration, and what the command line says over that.
struct SiteOptions {
  std::string config;
  int domain = -1, crane = -1;
};

void add_site_options(CLI::App& command, SiteOptions& options);

/// Error: Configuration.
Result<SiteConfig> read_site(const SiteOptions& options);

}  // namespace crane
