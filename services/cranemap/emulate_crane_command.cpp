// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "base/log.hpp"
#include "commands.hpp"
#include "emulated_crane.hpp"
#include "output.hpp"
#include "service/run_service.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

struct Options {
  EmulatedCraneOptions crane;
  SiteOptions site;
  TimeNs start_at = 0;
  double for_s = 0;
  bool truth = false;
};

Result<void> emulate(const Options& o) {
  auto site = read_site(o.site);
  if (!site) return site.error();
  auto crane = EmulatedCrane::prepare(o.crane, std::move(*site), o.truth);
  if (!crane) return crane.error();
  const TimeNs start = o.start_at > 0 ? o.start_at : SystemClock().now() + 2 * kNsPerSecond;
  if (auto started = crane->start_rangefinders(start); !started) return started;
  if (auto started = crane->start_camera(start); !started) return started;
  std::printf(
      "a crane is there; connect the services to it, in another terminal:\n"
      "  cranemap serve --site %s\n"
      "and look at its map:\n"
      "  cranemap watch --config %s/site.yaml\n",
      o.crane.folder.c_str(), o.crane.folder.c_str());
  if (!flush_output()) return {};
  Result<void> good;
  for (const Stopwatch watch; good && !stop_requested() && !crane->camera_ended() &&
                              (o.for_s == 0 || watch.ms() < o.for_s * 1000);) {
    std::this_thread::sleep_for(50ms);
    good = crane->watch();
  }
  crane->stop();
  return good;
}

}  // namespace

Command add_emulate_crane_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  EmulatedCraneOptions& o = options->crane;
  CLI::App* command = app.add_subcommand(
      "emulate-crane",
      "A whole crane without hardware: camera and both rangefinders emulated, on one trajectory\n"
      "and one clock, for the real drivers and services, and for trying your controller.\n"
      "Writes the calibration and a site.yaml that 'cranemap serve --site' takes as they are.\n"
      "Example: cranemap emulate-crane tests/data/rig --out /tmp/crane\n"
      "         cranemap emulate-crane lap --out /tmp/crane --rate 0.5");
  command
      ->add_option("FROM", o.from,
                   "Recording, played round and round in real time; or scene (YAML file, or the "
                   "name of one that ships), which is rendered live")
      ->required();
  command->add_option("--out", o.folder, "New folder for configuration, devices and pictures")
      ->required();
  add_site_options(*command, options->site);
  command
      ->add_option("--rate", o.rate_hz,
                   "Pairs a second of a scene; what is not rendered in time is left out")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  command->add_option("--speed", o.speed_mps, "Of a scene's crane [m/s]; 0 = the scene's")
      ->check(CLI::Range(0.0, 10.0));
  command->add_flag("--one-round", o.one_round, "End when a scene's crane has been everywhere");
  command->add_flag("--truth", options->truth,
                    "With --one-round: truth/ as well, for 'cranemap evaluate'");
  command->add_flag("--keep", o.pictures_kept, "Pictures stay after they were read");
  command->add_option("--start-at", options->start_at,
                      "Wall time [ns] of the first instant; 0 = in two seconds");
  command->add_option("--for", options->for_s, "Seconds; 0 = until it is stopped")
      ->check(CLI::Range(0.0, 1e7));
  return [options] {
    const auto done = emulate(*options);
    if (done) return static_cast<int>(kExitOk);
    log_error(done.error().text());
    return static_cast<int>(exit_code(done.error()));
  };
}

}  // namespace crane
