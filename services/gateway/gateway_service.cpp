// SPDX-License-Identifier: Apache-2.0
#include "gateway_service.hpp"

#include <CLI/CLI.hpp>
#include <filesystem>

#include "dds/service_numbers.hpp"
#include "gateway/watcher.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

struct Options {
  std::string calibration, page;
};

/// Beside the programs, as built and as installed.
std::string page_folder() {
  std::error_code failed;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", failed);
  return program.parent_path().parent_path() / "share/cranemap/gateway";
}

}  // namespace

int run_gateway(int argc, char** argv) {
  Options options;
  const ServiceInfo info{
      "cranemap-gateway",
      "Page for operator and integrator, and REST and WebSocket for who has no DDS; where: "
      "section\n"
      "gateway of the configuration, http://localhost:9480 without one. Reads only.\n"
      "Example: cranemap-gateway --config site.yaml --calibration RECORDING",
      dds::kServiceGateway};
  return run_service(
      argc, argv, info,
      [&](CLI::App& app) {
        app.add_option("--calibration", options.calibration,
                       "Folder of the camera's calibration, for what the camera sees of the floor");
        app.add_option("--page", options.page, "Folder of the built page; default: beside us");
      },
      [&](ServiceContext& context) {
        return gateway::serve(context, options.calibration,
                              options.page.empty() ? page_folder() : options.page);
      });
}

}  // namespace crane
