// SPDX-License-Identifier: Apache-2.0
#include "discovery_service.hpp"

#include <CLI/CLI.hpp>
#include <thread>

#include "bounds.h"
#include "service/run_service.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

/// Fast DDS does the work, in threads of its own.
Result<void> serve(ServiceContext& context) {
  while (!context.stopping()) {
    context.status.tick();
    std::this_thread::sleep_for(50ms);
  }
  return {};
}

}  // namespace

int run_discovery(int argc, char** argv) {
  int id = 0;
  ServiceInfo info{"cranemap-discovery",
                   "Discovery server: tells all participants of a plant of each other, without "
                   "multicast.\nListens at the port of dds.servers number --id. Run two, on two "
                   "hosts: each is enough.\nExample: cranemap-discovery --config site.yaml --id 0",
                   v1::SERVICE_DISCOVERY};
  info.adjust = [&id](dds::Settings& settings) -> Result<void> {
    if (id >= static_cast<int>(settings.servers.size()))
      return Error{ErrorCode::kConfiguration, "dds.servers", "has no number " + std::to_string(id),
                   "list this server there, from 0 on"};
    settings.server_id = id;
    return {};
  };
  return run_service(
      argc, argv, info,
      [&](CLI::App& app) {
        app.add_option("--id", id, "Which of dds.servers this is, from 0 on")
            ->check(CLI::Range(0, 3))
            ->capture_default_str();
      },
      serve);
}

}  // namespace crane
