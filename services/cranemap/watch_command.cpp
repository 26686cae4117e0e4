// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>

#include "base/log.hpp"
#include "bounds.h"
#include "commands.hpp"
#include "dds/endpoints.hpp"
#include "output.hpp"
#include "run_report.hpp"
#include "service/client_options.hpp"
#include "service/run_service.hpp"
#include "service/service_name.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

struct Options {
  SiteOptions site;
  double seconds = 0;
};

void show(const client::Status& map, const client::Map::ColumnCount& columns,
          const std::vector<client::Zone>& zones,
          const std::map<std::uint32_t, v1::ServiceStatus>& services) {
  if (isatty(1) != 0) std::printf("\x1b[H\x1b[2J");
  const char* validity = !map.heard ? "no mapper heard" : map.valid ? "VALID" : "NOT VALID";
  std::printf("map    %s%s%s  revision %llu  %u tiles  %s\n", validity,
              map.reason.empty() ? "" : ": ", map.reason.c_str(),
              static_cast<unsigned long long>(map.revision), map.tiles,
              map.complete ? "complete here" : "incomplete here");
  std::printf("frames in the map %llu, rejected %llu, missing %llu\n",
              static_cast<unsigned long long>(map.frames_integrated),
              static_cast<unsigned long long>(map.frames_rejected),
              static_cast<unsigned long long>(map.frames_missing));
  std::printf(
      "surfaces of %llu columns known, %.1f %% of them may be higher\n",
      static_cast<unsigned long long>(columns.known),
      columns.known > 0 ? 100.0 * double(columns.lower_bounds) / double(columns.known) : 0.0);
  if (map.hoist != client::Status::Hoist::kNotUsed)
    std::printf("hook and load %s\n",
                map.hoist == client::Status::Hoist::kKnown ? "known" : "LOST: nothing below them");
  for (const client::Zone& z : zones)
    std::printf("zone %u %s: %s, %s\n", z.id, z.name.c_str(),
                z.kind == client::Zone::Kind::kNoGo ? "no-go" : "slow-down",
                z.active ? "active" : "off");
  for (const auto& [id, s] : services) {
    const double age_s = double(SystemClock().now() - s.time_ns()) * 1e-9;
    std::printf("%-12s %s  in %llu  out %llu  cpu %.1f s  %.0f MiB  heard %.1f s ago\n",
                service_name(id), s.status() == 0 ? "ok      " : "DEGRADED",
                static_cast<unsigned long long>(s.received()),
                static_cast<unsigned long long>(s.published()), s.cpu_seconds(),
                double(s.memory_bytes()) / (1 << 20), age_s);
    for (const v1::DropCount& d : s.dropped())
      std::printf("             not used: %llu x %s\n", static_cast<unsigned long long>(d.count()),
                  d.cause().c_str());
  }
  std::printf("\n");
}

int watch(const Options& options) {
  auto site = read_site(options.site);
  if (!site) {
    log_error(site.error().text());
    return exit_code(site.error());
  }
  const SiteConfig& config = *site;
  const dds::Settings settings = to_settings(config, "dashboard");
  Wakeup wakeup;
  auto participant = dds::Participant::create(settings, "cranemap-watch");
  if (!participant) {
    log_error(participant.error().text());
    return exit_code(participant.error());
  }
  auto statuses = dds::Reader<dds::ServiceStatusTopic>::create(*participant, &wakeup);
  std::string why;
  const auto map = client::Map::join((*participant)->fast_dds(), map_options(config), why);
  if (!statuses || !map) {
    log_error(statuses ? why : statuses.error().text());
    return kExitResource;
  }
  std::map<std::uint32_t, v1::ServiceStatus> services;
  for (const Stopwatch since; !stop_requested();) {
    for (const Stopwatch second; second.ms() < 1000 && !stop_requested();) {
      wakeup.wait_for(100ms);
      while (const auto sample = statuses->take()) services[(*sample)->service()] = **sample;
    }
    show(map->status(), map->count_columns(), map->zones(), services);
    if (!flush_output()) break;
    if (options.seconds > 0 && since.ms() >= options.seconds * 1000) break;
  }
  return kExitOk;
}

}  // namespace

Command add_watch_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("watch", "Live text view of a running map and its services.");
  add_site_options(*command, options->site);
  command->add_option("--seconds", options->seconds, "Stop after this long; 0 = on Ctrl-C");
  return [options] { return watch(*options); };
}

}  // namespace crane
