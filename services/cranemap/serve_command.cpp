// SPDX-License-Identifier: Apache-2.0
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <random>
#include <thread>

#include "base/clock.hpp"
#include "base/log.hpp"
#include "child_process.hpp"
#include "commands.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr int kStopMs = 5000;
/// Waiting times between starts of a service that ends again and again [ms].
constexpr double kFirstWaitMs = 500, kLongestWaitMs = 4'000, kLivesMs = 10'000;

struct Options {
  std::string site, config, calibration, state, recording;
  std::vector<std::string> services = {"camera", "rangefinder", "stereo", "mapper", "clearance"};
  std::string rate = "real", stamps = "now";
  bool standby = false, log_json = false;
  bool live_camera = false;  ///< the configuration names one
  int id = 0;
  std::uint64_t stream = std::random_device{}() | 1U;
  TimeNs start = SystemClock().now() + 2 * kNsPerSecond;
};

/// One service, started again whenever it ends, however it does.
class Served {
 public:
  Served(std::string name, std::vector<std::string> command)
      : name_(std::move(name)), command_(std::move(command)) {}

  Result<void> start() {
    auto process = ChildProcess::start(command_, "");
    if (!process) return process.error();
    process_.emplace(std::move(*process));
    since_ = {};
    return {};
  }
  Result<void> watch() {
    if (process_) {
      const auto exit = process_->poll();
      if (!exit) return {};
      log_warning("cranemap-" + name_ +
                  (exit->by_signal ? " was killed by signal " : " ended with ") +
                  std::to_string(exit->code) + ": starts again in " +
                  std::to_string(int(wait_ms_)) + " ms");
      if (since_.ms() > kLivesMs) wait_ms_ = kFirstWaitMs;
      process_.reset();
      since_ = {};
    }
    if (since_.ms() < wait_ms_) return {};
    wait_ms_ = std::min(2 * wait_ms_, kLongestWaitMs);
    return start();
  }
  void signal(int number) const {
    if (process_) kill(process_->pid(), number);
  }
  void stop() {
    if (process_) process_->stop(kStopMs);
  }

 private:
  std::string name_;
  std::vector<std::string> command_;
  std::optional<ChildProcess> process_;
  Stopwatch since_;
  double wait_ms_ = kFirstWaitMs;
};

Result<std::vector<std::string>> arguments(const Options& o, const std::string& service) {
  std::vector<std::string> out;
  const auto add = [&out](std::initializer_list<std::string> more) {
    out.insert(out.end(), more.begin(), more.end());
  };
  const auto missing = [&service](const char* option) {
    return Error{ErrorCode::kConfiguration, option, "is needed for " + service, ""};
  };
  if (!o.config.empty()) add({"--config", o.config});
  if (o.log_json) add({"--log-json"});
  if (service == "mapper" || service == "stereo") {
    const std::string& calibration = o.calibration.empty() ? o.recording : o.calibration;
    if (calibration.empty()) return missing("--calibration");
    add({"--calibration", calibration});
  }
  if (service == "gateway") {
    const std::string& calibration = o.calibration.empty() ? o.recording : o.calibration;
    if (!calibration.empty()) add({"--calibration", calibration});
  }
  if (service == "mapper" && !o.state.empty()) add({"--state", o.state});
  if (service == "mapper" && o.standby) add({"--standby"});
  // Without a recording both are live; the rangefinder says itself what its configuration misses.
  const bool live = o.recording.empty();
  if (service == "camera" && live && !o.live_camera) return missing("--recording");
  if (service == "camera" && live && !o.calibration.empty()) add({"--calibration", o.calibration});
  if ((service == "camera" || service == "rangefinder") && !live) {
    // All players in step, and again so after one was restarted.
    add({o.recording, "--loop", "--stream", std::to_string(o.stream), "--start-at",
         std::to_string(o.start), "--resume", "--rate", o.rate, "--stamps", o.stamps});
  }
  if (service == "discovery") add({"--id", std::to_string(o.id)});
  return out;
}

/// A site's folder has its configuration and its calibration.
void take_site(Options& o) {
  if (o.site.empty()) return;
  if (o.config.empty()) o.config = o.site + "/site.yaml";
  if (o.calibration.empty()) o.calibration = o.site;
}

int serve(Options& options) {
  take_site(options);
  if (!options.config.empty()) {
    auto config = read_site_config(options.config);
    if (!config) {
      log_error(config.error().text());
      return exit_code(config.error());
    }
    options.live_camera = config->camera.source != CameraConfig::Source::kRecording;
  }
  std::error_code failed;
  const fs::path programs = fs::read_symlink("/proc/self/exe", failed).parent_path();
  if (options.log_json) set_log_format(LogFormat::kJson);
  std::vector<Served> services;
  for (const std::string& name : options.services) {
    auto more = arguments(options, name);
    if (!more) {
      log_error(more.error().text());
      return exit_code(more.error());
    }
    more->insert(more->begin(), programs / ("cranemap-" + name));
    services.emplace_back(name, std::move(*more));
  }
  Result<void> good;
  for (Served& s : services)
    if (good) good = s.start();
  while (good && !stop_requested()) {
    if (reload_requested())
      for (const Served& s : services) s.signal(SIGHUP);
    for (Served& s : services)
      if (good) good = s.watch();
    std::this_thread::sleep_for(50ms);
  }
  for (const Served& s : services) s.signal(SIGTERM);
  for (Served& s : services) s.stop();
  if (good) return kExitOk;
  log_error(good.error().text());
  return exit_code(good.error());
}

}  // namespace

Command add_serve_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  Options& o = *options;
  CLI::App* command = app.add_subcommand(
      "serve",
      "Runs services of a crane on this host and starts again what ends; logs go to stderr.\n"
      "Example: cranemap serve --config site.yaml --calibration calib --state state mapper stereo\n"
      "         cranemap serve --site DIR\n"
      "         cranemap serve --recording tests/data/rig camera rangefinder stereo mapper "
      "gateway");
  command
      ->add_option("SERVICES", o.services,
                   "Which of them; default: camera rangefinder stereo mapper clearance")
      ->check(CLI::IsMember({"camera", "rangefinder", "stereo", "mapper", "clearance",
                             "ros2-mirror", "discovery", "gateway"}));
  command
      ->add_option("--site", o.site,
                   "Folder that has both: site.yaml, and the calibration beside it, as 'cranemap "
                   "emulate-crane' writes it")
      ->check(CLI::ExistingDirectory);
  command->add_option("--config", o.config, "Site configuration (YAML)")->check(CLI::ExistingFile);
  command->add_option("--calibration", o.calibration,
                      "Folder with cam0/sensor.yaml, cam1/sensor.yaml and rig.yaml");
  command->add_option("--state", o.state, "Where the mapper keeps its map");
  command->add_option(
      "--recording", o.recording,
      "Played round and round by camera and rangefinder, where the configuration names no camera; "
      "may stand for --calibration");
  command->add_option("--rate", o.rate, "Of the recording: real or a factor")
      ->capture_default_str();
  command->add_option("--stamps", o.stamps, "Times of the recording's samples: now, or as recorded")
      ->check(CLI::IsMember({"now", "recorded"}))
      ->capture_default_str();
  command->add_option("--id", o.id, "Of the discovery server")->check(CLI::Range(0, 3));
  command->add_flag("--standby", o.standby, "The mapper is one of a pair");
  command->add_flag("--log-json", o.log_json, "Logs as one JSON object a line");
  return [options] { return serve(*options); };
}

}  // namespace crane
