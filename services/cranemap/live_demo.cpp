// SPDX-License-Identifier: Apache-2.0
#include "live_demo.hpp"

#include <cstdio>
#include <filesystem>
#include <optional>

#include "base/log.hpp"
#include "bounds.h"
#include "dds/endpoints.hpp"
#include "map_results.hpp"
#include "progress.hpp"
#include "result_folder.hpp"
#include "service/client_options.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr double kUpMs = 20'000, kSettleMs = 3'000;

class LiveDemo {
 public:
  explicit LiveDemo(const LiveDemoOptions& options) : options_(options) {}

  Result<int> execute() {
    auto claimed = ResultFolder::claim(options_.out);
    if (!claimed) return claimed.error();
    folder_.emplace(std::move(*claimed));
    EmulatedCraneOptions crane;
    crane.from = options_.scene;
    crane.folder = fs::path(folder_->state()) / "crane";
    crane.rate_hz = options_.rate_hz;
    crane.speed_mps = options_.speed_mps;
    crane.one_round = true;
    std::fprintf(stderr, "renders what the scene really looks like, to judge the map by\n");
    auto prepared = EmulatedCrane::prepare(crane, options_.site, true);
    if (!prepared) return prepared.error();
    crane_.emplace(std::move(*prepared));
    calibration_ = crane.folder;
    if (auto up = start_services(); !up) return up.error();
    if (auto followed = follow(); !followed) return followed.error();
    return close();
  }

 private:
  Result<void> start_services() {
    const SiteConfig& site = crane_->site();
    auto participant = dds::Participant::create(to_settings(site, "dashboard"), "cranemap-demo");
    if (!participant) return participant.error();
    auto statuses = dds::Reader<dds::ServiceStatusTopic>::create(*participant, &wakeup_);
    if (!statuses) return statuses.error();
    statuses_.emplace(std::move(*statuses));
    std::string why;
    map_ = client::Map::join((*participant)->fast_dds(), map_options(site), why);
    if (!map_) return Error{ErrorCode::kResource, "DDS", why, ""};
    std::error_code failed;
    services_.emplace(fs::read_symlink("/proc/self/exe", failed).parent_path(), options_.out);
    const std::string config = fs::path(calibration_) / "site.yaml";
    fs::copy_file(config, fs::path(options_.out) / "config.yaml", failed);
    const std::vector<std::string> common = {"--config", config};
    std::vector<std::string> calibrated = {"--config", config, "--calibration", calibration_};
    std::vector<std::string> mapper = calibrated;
    mapper.insert(mapper.end(), {"--save", options_.out});
    if (auto r = services_->start("mapper", mapper, {}); !r) return r;
    if (auto r = services_->start("stereo", calibrated, {}); !r) return r;
    if (auto r = services_->start("clearance", common, {}); !r) return r;
    // Before the camera's driver looks: what it finds then is old.
    for (const char* side : {"left", "right"})
      fs::create_directories(fs::path(crane_->site().camera.path) / side, failed);
    if (auto r = services_->start("camera", calibrated, {}); !r) return r;
    if (auto r = services_->start("rangefinder", common, {}); !r) return r;
    return wait_until_up();
  }

  Result<void> wait_until_up() {
    for (const Stopwatch watch; !stop_requested();) {
      if (auto alive = services_->watch(); !alive) return alive;
      take_statuses();
      const bool up = report_.services.contains(v1::SERVICE_CAMERA) &&
                      report_.services.contains(v1::SERVICE_RANGEFINDER) &&
                      report_.services.contains(v1::SERVICE_STEREO) && map_->status().heard;
      if (up) break;
      if (watch.ms() > kUpMs)
        return Error{ErrorCode::kResource, "services", "did not all tell of themselves within 20 s",
                     "their logs: " + options_.out + "/logs"};
      wakeup_.wait_for(20ms);
    }
    // Drivers try at most 2 s apart to reach their device: the first image has its positions.
    const TimeNs start_at = SystemClock().now() + 4 * kNsPerSecond;
    if (auto started = crane_->start_rangefinders(start_at); !started) return started;
    return crane_->start_camera(start_at);
  }

  [[nodiscard]] std::uint64_t received() const {
    const auto camera = report_.services.find(v1::SERVICE_CAMERA);
    return camera == report_.services.end() ? 0 : camera->second.received();
  }

  [[nodiscard]] std::uint64_t frames_done(const client::Status& s) const {
    const auto camera = report_.services.find(v1::SERVICE_CAMERA);
    const bool ours = camera != report_.services.end() && s.stream == camera->second.stream();
    return ours && s.last_frame_time_ns > 0 ? s.last_frame + 1 : 0;
  }

  /// Until the camera has been everywhere and the map accounted for all that it gave.
  Result<void> follow() {
    Progress progress("live");
    const Stopwatch watch;
    Stopwatch since_change;
    std::uint64_t last = 0;
    while (!stop_requested()) {
      if (auto alive = services_->watch(); !alive) return alive;
      if (auto alive = crane_->watch(); !alive) return alive;
      take_statuses();
      const client::Status s = map_->status();
      const std::uint64_t done = frames_done(s);
      if (done + received() != last || !crane_->camera_ended()) since_change = {};
      last = done + received();
      char detail[200];
      std::snprintf(detail, sizeof detail,
                    "frames  in the map %llu  not used %llu  %u tiles  %.100s",
                    static_cast<unsigned long long>(s.frames_integrated),
                    static_cast<unsigned long long>(s.frames_rejected + s.frames_missing), s.tiles,
                    s.valid ? "valid" : s.reason.c_str());
      progress.update(done, crane_->pairs(), detail);
      if (crane_->camera_ended() && since_change.ms() > kSettleMs) break;
      wakeup_.wait_for(50ms);
    }
    report_.wall_s = watch.ms() * 1e-3;
    progress.finish("the crane has been everywhere");
    return settle_map(*map_, *services_, wakeup_);
  }

  Result<int> close() {
    report_.map = map_->status();
    report_.voxels = map_->count_voxels();
    MapResults results{options_.out, fs::path(calibration_) / "truth",
                       fs::path(options_.scene).stem().string() + ", live", map_->heights(),
                       map_->zones()};
    crane_->stop();
    for (const char* name : {"camera", "rangefinder", "stereo", "clearance"})
      if (auto stopped = services_->stop(name, 5000); !stopped) log_warning(stopped.error().text());
    if (auto saved = services_->stop("mapper", 300'000); !saved) return saved.error();
    take_statuses();
    report_.recording = options_.scene;
    report_.verb = "given by the camera";
    report_.rate = "live";
    report_.method =
        options_.site.mapper.method == MapperConfig::Method::kPaper ? "paper" : "default";
    report_.network = network_name(options_.site.dds.network);
    report_.restarts = services_->restarts();
    report_.frames = received();
    if (auto written = write_map_results(results, report_); !written) return written.error();
    folder_->finish();
    print(report_);
    if (received() < crane_->pairs())
      log_warning(std::to_string(crane_->pairs() - received()) + " of " +
                  std::to_string(crane_->pairs()) +
                  " pairs were not rendered in time and left out: try a lower --rate");
    if (stop_requested()) return static_cast<int>(kExitDataLost);
    if (report_.map.reason_code >= v1::MAP_CART_POSITION)
      log_error("the map is not to be relied on: " + report_.map.reason);
    if (report_.frames > 0 && report_.map.frames_integrated == report_.frames)
      return static_cast<int>(kExitOk);
    log_error(std::to_string(report_.frames - report_.map.frames_integrated) +
              " frame(s) of the camera are not in the map; the causes are counted above");
    return static_cast<int>(kExitDataLost);
  }

  void take_statuses() {
    while (const auto sample = statuses_->take()) report_.services[(*sample)->service()] = **sample;
  }

  const LiveDemoOptions& options_;
  std::optional<ResultFolder> folder_;
  std::optional<EmulatedCrane> crane_;
  std::string calibration_;
  Wakeup wakeup_;
  std::optional<dds::Reader<dds::ServiceStatusTopic>> statuses_;
  std::unique_ptr<client::Map> map_;
  std::optional<Supervisor> services_;
  RunReport report_;
};

}  // namespace

int run_live_demo(const LiveDemoOptions& options) {
  const auto code = LiveDemo(options).execute();
  if (code) return *code;
  log_error(code.error().text());
  return exit_code(code.error());
}

}  // namespace crane
