// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>

#include "base/log.hpp"
#include "base/read_file.hpp"
#include "bounds.h"
#include "commands.hpp"
#include "dds/shared_memory.hpp"
#include "demo_page.hpp"
#include "live_demo.hpp"
#include "map_results.hpp"
#include "progress.hpp"
#include "recording/recording.hpp"
#include "result_folder.hpp"
#include "run_report.hpp"
#include "service/client_options.hpp"
#include "service/key_option.hpp"
#include "service/play_clock.hpp"
#include "service/run_service.hpp"
#include "supervisor.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr double kNoProgressMs = 60'000;
constexpr double kSettleMs = 3'000;

struct Options {
  std::string recording, out, config, method, rate = "max", network, stamps = "now";
  double voxel_m = -1;
  int domain = -1;
  // demo --live
  bool live = false;
  std::string scene = "lap";
  double live_rate_hz = 1, live_speed_mps = 0.15;
  // how demo ends
  bool headless = false, page = false;
};

/// What a configuration file and the command line say of the services. Error: Configuration.
Result<SiteConfig> configured(const Options& o, const std::string& file) {
  SiteConfig config;
  if (!file.empty()) {
    auto read = read_site_config(file);
    if (!read) return read;
    config = std::move(*read);
  }
  if (o.voxel_m >= 0) config.mapper.voxel_m = o.voxel_m;
  if (o.domain >= 0) config.dds.domain = static_cast<std::uint32_t>(o.domain);
  if (o.network == "container") {
    config.dds.network = NetworkSettings::Network::kContainer;
    config.dds.shared_memory = false;
  }
  if (!o.method.empty()) {
    const bool paper = o.method == "paper";
    config.mapper.method = paper ? MapperConfig::Method::kPaper : MapperConfig::Method::kDefault;
    config.stereo.paper = paper;
  }
  return config;
}

int fail(const Error& error) {
  log_error(error.text());
  return exit_code(error);
}

class Run {
 public:
  explicit Run(const Options& options) : options_(options) {}

  int execute() {
    if (auto ready = prepare(); !ready) return fail(ready.error());
    if (auto started = start_services(); !started) return fail(started.error());
    if (auto played = follow(); !played) return fail(played.error());
    auto closed = close();
    if (!closed) return fail(closed.error());
    print(report_);
    std::printf("\nfiles in %s:", options_.out.c_str());
    for (const auto& [name, bytes] : report_.files) std::printf(" %s", name.c_str());
    std::printf("\n");
    if (stop_requested()) return kExitDataLost;
    if (report_.map.frames_integrated == report_.frames) return kExitOk;
    // What concerns all frames says more than their number.
    if (report_.map.reason_code >= v1::MAP_CART_POSITION)
      log_error("the map is not to be relied on: " + report_.map.reason);
    log_error(std::to_string(report_.frames - report_.map.frames_integrated) +
              " frame(s) are not in the map; the causes are counted above and in report.json");
    return kExitDataLost;
  }

 private:
  Result<void> prepare() {
    // A recording may know its crane.
    const std::string own = options_.recording + "/site.yaml";
    const auto has_own = is_there(own);
    if (!has_own) return has_own.error();
    const std::string file = options_.config.empty() && *has_own ? own : options_.config;
    auto read = configured(options_, file);
    if (!read) return read.error();
    config_ = std::move(*read);
    auto rate = parse_rate(options_.rate);
    if (!rate) return rate.error();
    rate_ = *rate;
    auto recording = Recording::open(options_.recording);
    if (!recording) return recording.error();
    report_.frames = recording->frames().size();
    auto folder = ResultFolder::claim(options_.out);
    if (!folder) return folder.error();
    folder_.emplace(std::move(*folder));
    std::ofstream effective(fs::path(options_.out) / "config.yaml");
    effective << to_yaml(config_);
    effective.close();
    if (!effective)
      return Error{ErrorCode::kResource, options_.out, "cannot be written",
                   "give --out a folder on a disk with free space that you may write"};
    // Parsed back, so that what the services read is known to be good.
    if (auto again = parse_site_config(to_yaml(config_), "--config and options"); !again)
      return again.error();
    return {};
  }

  Result<void> start_services() {
    auto participant = dds::Participant::create(to_settings(config_, "dashboard"), "cranemap-run");
    if (!participant) return participant.error();
    auto statuses = dds::Reader<dds::ServiceStatusTopic>::create(*participant, &wakeup_);
    if (!statuses) return statuses.error();
    statuses_.emplace(std::move(*statuses));
    std::string why;
    map_ = client::Map::join((*participant)->fast_dds(), map_options(config_), why);
    if (!map_) return Error{ErrorCode::kResource, "DDS", why, ""};

    std::error_code failed;
    const fs::path programs = fs::read_symlink("/proc/self/exe", failed).parent_path();
    services_.emplace(programs, options_.out);
    const std::string config = options_.out + "/config.yaml";
    stream_ = std::random_device{}() | 1U;
    if (auto r = services_->start("mapper",
                                  {"--config", config, "--calibration", options_.recording,
                                   "--save", options_.out, "--state", folder_->state()},
                                  {});
        !r)
      return r;
    if (auto r = services_->start("stereo",
                                  {"--config", config, "--calibration", options_.recording}, {});
        !r)
      return r;
    // The mapper listens for a rival first: play begins when its heartbeat is heard.
    for (const Stopwatch watch; !map_->status().heard;) {
      if (auto alive = services_->watch(); !alive) return alive;
      if (stop_requested() || watch.ms() > 20'000)
        return Error{ErrorCode::kResource, "cranemap-mapper", "gave no heartbeat within 20 s",
                     "its log: " + options_.out + "/logs/mapper.log"};
      wakeup_.wait_for(20ms);
    }
    std::vector<std::string> play = {"--config",    config,     options_.recording,     "--rate",
                                     options_.rate, "--stream", std::to_string(stream_)};
    std::vector<std::string> again;
    // One start for both: it paces a timed play, and makes the time stamps of both those of now.
    const TimeNs start = SystemClock().now() + (rate_.paced_by_map() ? 0 : kNsPerSecond);
    play.insert(play.end(), {"--start-at", std::to_string(start), "--stamps", options_.stamps});
    if (!rate_.paced_by_map()) again = {"--resume"};
    if (auto r = services_->start("rangefinder", play, again); !r) return r;
    return services_->start("camera", play, again);
  }

  /// Until the map has accounted for every frame that the camera published.
  Result<void> follow() {
    Progress progress("mapping");
    const Stopwatch watch;
    for (;;) {
      if (auto played = follow_play(progress, watch); !played) return played;
      report_.wall_s = watch.ms() * 1e-3;
      if (auto settled = settle_map(*map_, *services_, wakeup_); !settled) return settled;
      if (stop_requested() || !mapper_fell_back()) break;
      log_warning("the mapper went on from a map without the last frames: they are played again");
      for (const char* player : {"rangefinder", "camera"})
        if (auto started = services_->start_again(player); !started) return started;
      report_.services.erase(v1::SERVICE_CAMERA);  // its predecessor had finished
    }
    progress.finish("mapping done: " + std::to_string(frames_done(map_->status())) + " of " +
                    std::to_string(report_.frames) + " frames accounted for");
    return {};
  }

  [[nodiscard]] std::uint64_t frames_done(const client::Status& s) const {
    return s.stream == stream_ && s.last_frame_time_ns > 0 ? s.last_frame + 1 : 0;
  }

  Result<void> follow_play(Progress& progress, const Stopwatch& watch) {
    std::uint64_t last_done = 0;
    Stopwatch since_progress;
    while (!stop_requested()) {
      if (auto alive = services_->watch(); !alive) return alive;
      take_statuses();
      const client::Status s = map_->status();
      const std::uint64_t done = frames_done(s);
      if (done != last_done) {
        last_done = done;
        since_progress = {};
      }
      char detail[160];
      std::snprintf(
          detail, sizeof detail, "frames  %.1f/s  in the map %llu  not used %llu  %u tiles",
          double(done) / std::max(0.001, watch.ms() * 1e-3),
          static_cast<unsigned long long>(done > 0 ? s.frames_integrated : 0),
          static_cast<unsigned long long>(done > 0 ? s.frames_rejected + s.frames_missing : 0),
          s.tiles);
      progress.update(done, report_.frames, detail);
      const auto camera = report_.services.find(v1::SERVICE_CAMERA);
      const bool finished = services_->ended("camera") ||
                            (camera != report_.services.end() && camera->second.finished() == 1);
      if (finished && (done >= report_.frames || since_progress.ms() > kSettleMs)) break;
      if (since_progress.ms() > kNoProgressMs)
        return Error{ErrorCode::kResource, "map", "no frame was accounted for in 60 s",
                     "logs: " + options_.out + "/logs"};
      wakeup_.wait_for(50ms);
    }
    return {};
  }

  /// Whether the mapper was killed and its map on disk lacked frames that players would send again
  /// if they had not ended.
  bool mapper_fell_back() {
    const auto restarts = services_->restarts().find("mapper");
    const int kills = restarts == services_->restarts().end() ? 0 : restarts->second;
    const bool fell_back = rate_.paced_by_map() && kills > mapper_kills_ &&
                           frames_done(map_->status()) < report_.frames;
    mapper_kills_ = kills;
    return fell_back;
  }

  Result<void> close() {
    report_.map = map_->status();
    report_.voxels = map_->count_voxels();
    MapResults results{options_.out, fs::path(options_.recording) / "truth",
                       fs::path(options_.recording).filename(), map_->heights(), map_->zones()};
    for (const char* name : {"camera", "rangefinder", "stereo"})
      if (auto stopped = services_->stop(name, 5000); !stopped) log_warning(stopped.error().text());
    auto saved = services_->stop("mapper", 300'000);
    for (const Stopwatch watch; watch.ms() < 300;) {
      wakeup_.wait_for(50ms);
      take_statuses();
    }
    if (!saved) return saved;
    if (report_.map.stream != stream_ || report_.map.last_frame_time_ns == 0) {
      report_.map.frames_integrated = 0;
      report_.map.frames_rejected = 0;
      report_.map.frames_missing = report_.frames;
    } else if (report_.map.last_frame + 1 < report_.frames) {
      report_.map.frames_missing += report_.frames - report_.map.last_frame - 1;
    }
    report_.recording = options_.recording;
    report_.method = config_.mapper.method == MapperConfig::Method::kPaper ? "paper" : "default";
    report_.rate = options_.rate;
    report_.network = network_name(config_.dds.network);
    report_.restarts = services_->restarts();
    auto written = write_map_results(results, report_);
    folder_->finish();
    return written;
  }

  void take_statuses() {
    while (const auto sample = statuses_->take()) report_.services[(*sample)->service()] = **sample;
  }

  const Options& options_;
  std::optional<ResultFolder> folder_;
  SiteConfig config_;
  PlayRate rate_;
  int mapper_kills_ = 0;
  std::uint64_t stream_ = 0;
  Wakeup wakeup_;
  std::optional<dds::Reader<dds::ServiceStatusTopic>> statuses_;
  std::unique_ptr<client::Map> map_;
  std::optional<Supervisor> services_;
  RunReport report_;
};

void add_common(CLI::App& command, Options& o) {
  command.add_option("--voxel", o.voxel_m, "Voxel edge [m]; 0 = automatic")
      ->check(within<CLI::Range>("mapper.voxel_m", 0.0));
  command
      .add_option("--method", o.method,
                  "default, or paper: the 2021 paper's steps, matching included")
      ->check(CLI::IsMember({"default", "paper"}));
  command.add_option("--rate", o.rate, "real, a factor of it, or max: as fast as nothing is lost")
      ->capture_default_str();
  command
      .add_option("--stamps", o.stamps,
                  "Times of the samples: now, or as recorded. A controller's own hoist_state "
                  "agrees with now")
      ->check(CLI::IsMember({"now", "recorded"}))
      ->capture_default_str();
  command.add_option(
      "--config", o.config,
      "Site configuration (YAML) for all services; else site.yaml of the recording, if any");
  command.add_option("--domain", o.domain, "DDS domain, over that of --config")
      ->check(within<CLI::Range>("dds.domain", 0));
  command
      .add_option("--network", o.network,
                  "local (shared memory) or container (UDP only), over that of --config")
      ->check(CLI::IsMember({"local", "container"}));
}

int run_and_clean(const Options& options) {
  const int code = Run(options).execute();
  (void)dds::remove_stale_segments();  // of services that were killed, now that we do not hold them
  return code;
}

/// The recording that ships with cranemap: beside an installed program, or where told.
std::string demo_recording() {
  if (const char* told = std::getenv("CRANEMAP_DEMO_RECORDING")) return told;
  std::error_code failed;
  return fs::read_symlink("/proc/self/exe", failed).parent_path().parent_path() /
         "share/cranemap/rig";
}

int run_live(const Options& o) {
  LiveDemoOptions demo{o.scene, o.out, {}, o.live_rate_hz, o.live_speed_mps};
  auto site = configured(o, o.config);
  if (!site) return fail(site.error());
  demo.site = std::move(*site);
  if (auto good = parse_site_config(to_yaml(demo.site), "--config and options"); !good)
    return fail(good.error());
  const int code = run_live_demo(demo);
  (void)dds::remove_stale_segments();
  return code;
}

/// After its results the demo stays on the page: for whoever sits before it, not for scripts.
bool ends_on_page(const Options& o, int code) {
  if (o.headless || stop_requested() || (code != kExitOk && code != kExitDataLost)) return false;
  return o.page || (isatty(STDOUT_FILENO) != 0 && isatty(STDIN_FILENO) != 0);
}

int demo_page(const Options& o) {
  auto site = configured(o, o.config);
  if (!site) return fail(site.error());
  const int code = show_demo_page({"demo_round", o.out, std::move(*site), 2});
  (void)dds::remove_stale_segments();
  return code;
}

}  // namespace

Command add_run_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "run",
      "Map a recording: starts all services as processes, plays it, saves the map.\n"
      "Example: cranemap run RECORDING --out OUT --voxel 0.02");
  command->add_option("RECORDING", options->recording, "Folder in ASL/EuRoC layout")->required();
  command
      ->add_option("--out", options->out,
                   "Folder for map.bt map.ot map.pcd height_map.png report.json")
      ->required();
  add_common(*command, *options);
  return [options] { return run_and_clean(*options); };
}

Command add_demo_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  options->out = "out/demo";
  options->voxel_m = 0.02;
  options->rate = "real";
  options->domain = 71;
  CLI::App* command = app.add_subcommand(
      "demo",
      "Map the recording that ships with cranemap: the 2021 paper's rig, six positions.\n"
      "With --live: a crane without hardware drives through a scene; its camera is rendered as it\n"
      "goes, its rangefinders answer on pseudo-terminals, all by the real drivers into the map.");
  options->recording = demo_recording();
  command->add_option("--recording", options->recording, "Another recording")
      ->capture_default_str();
  command->add_option("--out", options->out, "Folder for the results")->capture_default_str();
  add_common(*command, *options);
  auto* live = command->add_flag("--live", options->live, "Emulated devices, not a recording");
  command->add_option("--scene", options->scene, "Of --live: scene file, or one that ships")
      ->capture_default_str();
  command->add_option("--live-rate", options->live_rate_hz, "Pairs a second to be rendered")
      ->check(CLI::Range(0.05, 30.0))
      ->needs(live)
      ->capture_default_str();
  command->add_option("--live-speed", options->live_speed_mps, "Of the crane [m/s]")
      ->check(CLI::Range(0.01, 2.0))
      ->needs(live)
      ->capture_default_str();
  auto* headless = command->add_flag("--headless", options->headless,
                                     "End with the results, as always where output is no terminal");
  command
      ->add_flag(
          "--page", options->page,
          "Stay on the gateway's page until Ctrl-C, as always on a terminal: a crane without "
          "hardware drives laps, a load is carried, a crate comes and goes")
      ->excludes(headless);
  return [options] {
    const int code = options->live ? run_live(*options) : run_and_clean(*options);
    if (code == kExitOk)
      std::printf(
          "\nlook at: %s/height_map_view.png\n         octovis %s/map.ot     pcl_viewer "
          "%s/map.pcd\n",
          options->out.c_str(), options->out.c_str(), options->out.c_str());
    if (!ends_on_page(*options, code)) return code;
    const int shown = demo_page(*options);
    return shown == kExitOk ? code : shown;
  };
}

}  // namespace crane
