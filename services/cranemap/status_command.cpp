// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <map>
#include <optional>
#include <thread>

#include "base/log.hpp"
#include "bounds.h"
#include "commands.hpp"
#include "crane/client/map.hpp"
#include "dds/endpoints.hpp"
#include "output.hpp"
#include "service/client_options.hpp"
#include "service/datagrams_refused.hpp"
#include "service/run_service.hpp"
#include "service/service_name.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

struct Options {
  SiteOptions site;
  double wait_s = 10;
  std::uint64_t frames = 0;
  bool follow = false;
};

/// Of the columns whose surface is known: heights that may be more.
double lower_bound_share(const client::Map& map) {
  const client::Map::ColumnCount columns = map.count_columns();
  return columns.known > 0 ? double(columns.lower_bounds) / double(columns.known) : 0;
}

void print(const client::Status& s, double lower_bounds) {
  std::printf("valid: %s\ncomplete: %s\nreason: \"%s\"\nreason_code: %u\nmapper: %016" PRIx64
              "\nmap_id: %016" PRIx64 "\nrevision: %" PRIu64 "\nvoxel_digest: %016" PRIx64
              "\nheight_digest: %016" PRIx64 "\ntiles: %u\nzones_revision: %" PRIu64
              "\nlast_frame_time_ns: %" PRId64 "\nframes_integrated: %" PRIu64
              "\nframes_rejected: %" PRIu64 "\nframes_missing: %" PRIu64
              "\nsamples_refused: %" PRIu64 "\nresyncs: %" PRIu64 "\nlower_bounds: %.4f\n",
              s.valid ? "true" : "false", s.complete ? "true" : "false", s.reason.c_str(),
              s.reason_code, s.mapper, s.map_id, s.revision, s.voxel_digest, s.height_digest,
              s.tiles, s.zones_revision, s.last_frame_time_ns, s.frames_integrated,
              s.frames_rejected, s.frames_missing, s.samples_refused, s.resyncs, lower_bounds);
}

/// What the services last said of themselves.
class Services {
 public:
  /// Who may not read that, by its permissions, is told so.
  explicit Services(const std::shared_ptr<dds::Participant>& participant) {
    auto reader = dds::Reader<dds::ServiceStatusTopic>::create(participant, nullptr);
    if (reader)
      reader_.emplace(std::move(*reader));
    else
      log_warning("neither figures nor refusals: " + reader.error().text());
  }

  /// As YAML, of those that are heard: what the mapper's watchdog measures, with standard
  /// deviations, and how many datagrams each service's guard has refused since its start.
  void print() {
    if (!reader_) return;
    const Stopwatch watch;
    for (take(); !said_.contains(v1::SERVICE_MAPPER) && watch.ms() < 2500; take()) {
      if (stop_requested()) return;
      std::this_thread::sleep_for(20ms);
    }
    if (const auto mapper = said_.find(v1::SERVICE_MAPPER); mapper != said_.end()) {
      std::printf("figures:\n");
      for (const v1::StatusFigure& f : mapper->second.figures())
        std::printf("  %s: {value: %.6g, sigma: %.2g}\n", f.name().c_str(), f.value(), f.sigma());
    }
    std::uint64_t sum = 0;
    std::string each;
    for (const auto& [service, status] : said_) {
      const std::uint64_t refused = datagrams_refused(status);
      sum += refused;
      each += std::string("  ") + service_name(service) + ": " + std::to_string(refused) + "\n";
    }
    std::printf("datagrams_refused: %" PRIu64 "\n", sum);
    if (!each.empty()) std::printf("datagrams_refused_by:\n%s", each.c_str());
  }

 private:
  void take() {
    while (const auto sample = reader_->take()) said_[(*sample)->service()] = **sample;
  }

  std::optional<dds::Reader<dds::ServiceStatusTopic>> reader_;
  std::map<std::uint32_t, v1::ServiceStatus> said_;  ///< by service
};

/// A line with its time for each change of the mapper that serves or of the map's validity.
void follow(const client::Map& map, double seconds) {
  std::uint64_t mapper = 0;
  std::optional<bool> valid;
  Stopwatch since;
  const auto now_s = [] { return double(SystemClock().now()) * 1e-9; };
  for (const Stopwatch watch; watch.ms() < seconds * 1000 && !stop_requested();) {
    const client::Status s = map.status();
    if (s.heard && s.mapper != mapper) {
      mapper = s.mapper;
      std::printf("mapper %.3f %016" PRIx64 "\n", now_s(), mapper);
    }
    if (valid != s.valid) {
      if (s.valid && valid) std::printf("invalid_for %.3f\n", since.ms() * 1e-3);
      std::printf("%s %.3f %s\n", s.valid ? "valid" : "invalid", now_s(), s.reason.c_str());
      since = {};
    }
    valid = s.valid;
    if (!flush_output()) return;
    std::this_thread::sleep_for(5ms);
  }
}

int status(const Options& options) {
  auto site = read_site(options.site);
  if (!site) {
    log_error(site.error().text());
    return exit_code(site.error());
  }
  std::string why;
  const auto participant =
      dds::Participant::create(to_settings(*site, "dashboard"), "cranemap-status");
  if (!participant) {
    log_error(participant.error().text());
    return exit_code(participant.error());
  }
  const auto map = client::Map::join((*participant)->fast_dds(), map_options(*site), why);
  if (!map) {
    log_error(why);
    return kExitResource;
  }
  if (options.follow) {
    follow(*map, options.wait_s);
    return kExitOk;
  }
  Services services(*participant);  // hears while the map comes
  client::Status s = map->status();
  const auto good = [&] { return s.valid && s.complete && s.frames_integrated >= options.frames; };
  for (const Stopwatch watch; !good() && watch.ms() < options.wait_s * 1000 && !stop_requested();) {
    std::this_thread::sleep_for(20ms);
    s = map->status();
  }
  print(s, lower_bound_share(*map));
  services.print();
  return good() ? kExitOk : kExitResource;
}

}  // namespace

Command add_status_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "status",
      "Joins, waits for a valid and complete map, prints its status as YAML; for scripts.\n"
      "Under figures: what the watchdog measures of calibration and positions, with standard "
      "deviations; under datagrams_refused: what the guard before Fast DDS refused, by service.\n"
      "Exit code 0: valid and complete; 3: not within --wait.");
  add_site_options(*command, options->site);
  command->add_option("--wait", options->wait_s, "Seconds to wait at most")
      ->check(CLI::Range(0.0, 86'400.0))
      ->capture_default_str();
  command->add_flag("--follow", options->follow,
                    "Say each change of mapper and validity instead, for --wait seconds");
  command->add_option("--frames", options->frames, "Wait for so many frames in the map, too");
  return [options] { return status(*options); };
}

}  // namespace crane
