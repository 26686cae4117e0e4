// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/site_config.hpp"

namespace crane {

struct DemoPageOptions {
  std::string scene;  ///< driven through without end
  std::string logs;   ///< folder of the services' logs: in its logs/
  SiteConfig site;    ///< of the services; camera and rangefinders become the emulated ones
  double rate_hz = 1;
};

/// The demo's last part: a crane without hardware drives round and round, its map is on the
/// gateway's page, whose address is printed, until Ctrl-C. Returns the exit code.
int show_demo_page(const DemoPageOptions& options);

}  // namespace crane
