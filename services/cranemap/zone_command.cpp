// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>
#include <random>
#include <thread>

#include "base/log.hpp"
#include "bounds.h"
#include "commands.hpp"
#include "crane/client/map.hpp"
#include "service/client_options.hpp"
#include "service/run_service.hpp"
#include "service/zone_sample.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

struct Options {
  std::string action, file;
  std::uint32_t id = 0;
  SiteOptions site;
};

int fail(const Error& error) {
  log_error(error.text());
  return exit_code(error);
}

void print(const std::vector<client::Zone>& zones) {
  if (zones.empty()) std::printf("no zone\n");
  for (const client::Zone& z : zones)
    std::printf("zone %u  %-9s  %-3s  %s  z %.2f to %.2f m  %zu corners  %s\n", z.id,
                z.kind == client::Zone::Kind::kNoGo ? "no-go" : "slow-down",
                z.active ? "on" : "off", z.switchable ? "switchable" : "fixed     ", z.z_min_m,
                z.z_max_m, z.corners.size(), z.name.c_str());
}

/// What is to be commanded: one zone, or all of a file.
Result<std::vector<v1::ZoneCommand>> commands_of(const Options& o, std::uint32_t crane) {
  std::vector<v1::ZoneCommand> out;
  v1::ZoneCommand c;
  c.crane(crane);
  c.zone().id(o.id);
  if (o.action == "set") {
    auto file = read_site_config(o.file);
    if (!file) return file.error();
    if (file->zones.empty())
      return Error{ErrorCode::kConfiguration, o.file, "has no zones", "see idl/README.md"};
    c.action(v1::ZONE_SET);
    for (const ZoneConfig& zone : file->zones) {
      c.zone(to_sample(zone));
      out.push_back(c);
    }
    return out;
  }
  c.action(o.action == "remove" ? v1::ZONE_REMOVE : v1::ZONE_SWITCH);
  c.zone().active(o.action == "on" ? 1 : 0);
  out.push_back(c);
  return out;
}

/// Whether the mapper's zones are as commanded.
bool done(const v1::ZoneCommand& c, const std::vector<client::Zone>& zones) {
  const auto it = std::find_if(zones.begin(), zones.end(),
                               [&](const client::Zone& z) { return z.id == c.zone().id(); });
  if (c.action() == v1::ZONE_REMOVE) return it == zones.end();
  return it != zones.end() && it->active == (c.zone().active() == 1) &&
         (c.action() == v1::ZONE_SWITCH || it->name == c.zone().name().c_str());
}

int zone(const Options& options) {
  auto site = read_site(options.site);
  if (!site) return fail(site.error());
  const SiteConfig& config = *site;
  const bool listing = options.action == "list";
  if ((options.action == "set") == options.file.empty() ||
      (!listing && options.action != "set" && options.id == 0))
    return fail(Error{ErrorCode::kConfiguration, "zone " + options.action,
                      "needs " + std::string(options.action == "set" ? "--file" : "--id"),
                      "see --help"});
  std::string why;
  auto participant = dds::Participant::create(to_settings(config, "operator"), "cranemap-zone");
  if (!participant) return fail(participant.error());
  const auto map = client::Map::join((*participant)->fast_dds(), map_options(config), why);
  if (!map) return fail(Error{ErrorCode::kResource, "map", why, ""});
  if (!map->wait_until_complete(10s))
    return fail(Error{ErrorCode::kNotAvailable, "map",
                      "is not complete within 10 s: " + map->status().reason,
                      "is cranemap-mapper running for this crane and domain?"});
  if (listing) {
    print(map->zones());
    return kExitOk;
  }
  const auto crane = static_cast<std::uint32_t>(config.crane);
  auto commands = commands_of(options, crane);
  if (!commands) return fail(commands.error());
  auto writer = dds::Writer<dds::ZoneCommandTopic>::create(*participant);
  if (!writer) return fail(writer.error());
  std::random_device random;
  const std::uint64_t client = std::uint64_t(random()) << 32U | random();
  std::uint64_t number = 0;
  for (v1::ZoneCommand& c : *commands) {
    c.client(client);
    c.sequence_number(++number);
    bool shown = false;
    // The same command until it shows: the first may come before the mapper is known.
    for (int tries = 0; tries < 30 && !shown && !stop_requested(); ++tries) {
      c.time_ns(SystemClock().now());
      if (auto sent = writer->write(c); !sent) return fail(sent.error());
      for (int i = 0; i < 10 && !shown; ++i) {
        std::this_thread::sleep_for(20ms);
        shown = done(c, map->zones());
      }
    }
    if (!shown)
      return fail(Error{ErrorCode::kConfiguration, "zone " + std::to_string(c.zone().id()),
                        "the mapper did not do it",
                        "fixed zones cannot be changed; the mapper's log says why"});
  }
  print(map->zones());
  return kExitOk;
}

}  // namespace

Command add_zone_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "zone",
      "No-go and slow-down zones of a running map.\n"
      "Example: cranemap zone list\n"
      "Example: cranemap zone off --id 3\n"
      "Example: cranemap zone set --file zones.yaml     (its section 'zones', as in a site's)");
  command->add_option("ACTION", options->action, "list, on, off, remove or set")
      ->required()
      ->check(CLI::IsMember({"list", "on", "off", "remove", "set"}));
  command->add_option("--id", options->id, "Of the zone: on, off, remove");
  command->add_option("--file", options->file, "Zones to set")->check(CLI::ExistingFile);
  add_site_options(*command, options->site);
  return [options] { return zone(*options); };
}

}  // namespace crane
