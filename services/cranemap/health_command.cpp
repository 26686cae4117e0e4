// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>

#include "base/log.hpp"
#include "bounds.h"
#include "commands.hpp"
#include "service/exit_code.hpp"
#include "service/health.hpp"
#include "service/service_name.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

int health(const SiteOptions& options) {
  auto site = read_site(options);
  if (!site) {
    log_error(site.error().text());
    return exit_code(site.error());
  }
  int heard = 0;
  bool well = true;
  for (std::uint32_t service = v1::SERVICE_CAMERA; service <= dds::kLastService; ++service) {
    const auto answer = ask_health(site->http.address, site->http.port + static_cast<int>(service));
    if (!answer && answer.error().code == ErrorCode::kNotAvailable) continue;
    ++heard;
    well = well && answer.ok();
    std::printf("%s: %s\n", service_name(service),
                answer ? "healthy" : answer.error().what.c_str());
  }
  if (heard == 0) std::printf("no service answers on this host\n");
  return heard > 0 && well ? kExitOk : kExitResource;
}

}  // namespace

Command add_health_command(CLI::App& app) {
  auto options = std::make_shared<SiteOptions>();
  CLI::App* command =
      app.add_subcommand("health",
                         "Asks the services of this host over HTTP how they are.\nExit code 0: all "
                         "that answer are healthy; 3: one is not, or none answers.");
  add_site_options(*command, *options);
  return [options] { return health(*options); };
}

}  // namespace crane
