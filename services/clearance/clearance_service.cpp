// SPDX-License-Identifier: Apache-2.0
#include "clearance_service.hpp"

#include "bounds.h"
#include "clearance/clearance_server.hpp"
#include "service/client_options.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

Result<void> serve(ServiceContext& context) {
  std::string why;
  auto map = client::Map::join(context.participant->fast_dds(), map_options(context.config), why);
  if (!map)
    return Error{ErrorCode::kResource, "map", "cannot be followed: " + why,
                 "check dds in the configuration"};
  auto server = ClearanceServer::create(context.participant, std::move(map));
  if (!server) return server.error();
  StatusReporter& status = context.status;
  const auto collect = [&] {
    status.stages = server->stages;
    status.dropped = server->dropped;
    add_reader_drops(status.dropped, Cause::kRequestInvalid, Cause::kRequestLost, server->counts());
  };
  while (!context.stopping()) {
    if (auto done = server->step(50ms); !done) return done;
    const client::Status followed = server->map().status();
    status.status = followed.valid && followed.complete ? v1::STATUS_OK : v1::STATUS_DEGRADED;
    status.message = followed.valid ? "" : followed.reason;
    status.received = server->counts().received;
    status.published = server->answered();
    if (status.due()) collect();
    status.tick();
  }
  collect();
  return {};
}

}  // namespace

int run_clearance(int argc, char** argv) {
  const ServiceInfo info{"cranemap-clearance",
                         "May the load go there? Topic clearance_request in, clearance_reply out, "
                         "from the map as it is published.\nExample: cranemap-clearance --config "
                         "site.yaml",
                         v1::SERVICE_CLEARANCE};
  return run_service(
      argc, argv, info, [](CLI::App&) {}, serve);
}

}  // namespace crane
