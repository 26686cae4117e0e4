// SPDX-License-Identifier: Apache-2.0
#include "demo_page.hpp"

#include <cstdio>
#include <filesystem>
#include <optional>
#include <set>

#include "base/log.hpp"
#include "base/scratch_folder.hpp"
#include "base/wakeup.hpp"
#include "dds/endpoints.hpp"
#include "dds/service_numbers.hpp"
#include "emulated_crane.hpp"
#include "output.hpp"
#include "service/client_options.hpp"
#include "service/run_service.hpp"
#include "supervisor.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr double kUpMs = 20'000;

class DemoPage {
 public:
  explicit DemoPage(const DemoPageOptions& options) : options_(options) {}
  ~DemoPage() { stop(); }
  DemoPage(const DemoPage&) = delete;
  DemoPage& operator=(const DemoPage&) = delete;

  Result<void> execute() {
    if (folder_.path().empty())
      return Error{ErrorCode::kResource, "temporary folder", "cannot be made",
                   "give TMPDIR a folder that can be written"};
    EmulatedCraneOptions crane;
    crane.from = options_.scene;
    crane.folder = folder_.path();
    crane.rate_hz = options_.rate_hz;
    auto prepared = EmulatedCrane::prepare(crane, options_.site, false);
    if (!prepared) return prepared.error();
    crane_.emplace(std::move(*prepared));
    if (auto up = start(); !up) return up;
    const GatewayConfig& g = options_.site.gateway;
    std::printf(
        "\nlook at the map as it grows, round and round: %s://localhost:%d/%s\n"
        "  integrator's view: /integrator.html, API: /api/v1/openapi.json, Foxglove: ws%s://...\n"
        "Ctrl-C ends it.\n",
        g.tls() ? "https" : "http", g.port, g.token_file.empty() ? "" : "?token=...",
        g.tls() ? "s" : "");
    if (!flush_output()) return {};
    while (!stop_requested()) {
      if (auto alive = services_->watch(); !alive) return alive;
      if (auto alive = crane_->watch(); !alive) return alive;
      wakeup_.wait_for(50ms);
      take_statuses();
    }
    return {};
  }

 private:
  Result<void> start() {
    const SiteConfig& site = crane_->site();
    auto participant = dds::Participant::create(to_settings(site, "dashboard"), "cranemap-demo");
    if (!participant) return participant.error();
    auto statuses = dds::Reader<dds::ServiceStatusTopic>::create(*participant, &wakeup_);
    if (!statuses) return statuses.error();
    statuses_.emplace(std::move(*statuses));
    std::error_code failed;
    services_.emplace(fs::read_symlink("/proc/self/exe", failed).parent_path(), options_.logs);
    for (const char* side : {"left", "right"})
      fs::create_directories(fs::path(site.camera.path) / side, failed);
    const std::string config = fs::path(folder_.path()) / "site.yaml";
    const std::vector<std::string> common = {"--config", config};
    const std::vector<std::string> calibrated = {"--config", config, "--calibration",
                                                 folder_.path()};
    for (const char* name : {"mapper", "stereo", "gateway", "camera"})
      if (auto r = services_->start(name, calibrated, {}); !r) return r;
    for (const char* name : {"clearance", "rangefinder"})
      if (auto r = services_->start(name, common, {}); !r) return r;
    for (const Stopwatch watch; !stop_requested() && heard_.size() < 6;) {
      if (auto alive = services_->watch(); !alive) return alive;
      if (watch.ms() > kUpMs)
        return Error{ErrorCode::kResource, "services", "did not all tell of themselves within 20 s",
                     "their logs: " + options_.logs + "/logs"};
      wakeup_.wait_for(20ms);
      take_statuses();
    }
    // Drivers try at most 2 s apart to reach their device.
    const TimeNs start_at = SystemClock().now() + 4 * kNsPerSecond;
    if (auto started = crane_->start_rangefinders(start_at); !started) return started;
    return crane_->start_camera(start_at);
  }

  void take_statuses() {
    while (const auto sample = statuses_->take()) heard_.insert((*sample)->service());
  }

  void stop() {
    if (crane_) crane_->stop();
    if (!services_) return;
    for (const char* name : {"camera", "rangefinder", "gateway", "clearance", "stereo", "mapper"})
      if (auto stopped = services_->stop(name, 5000); !stopped) log_warning(stopped.error().text());
  }

  const DemoPageOptions& options_;
  /// Of the emulated crane: pictures, pseudo-terminals, configuration.
  ScratchFolder folder_{"cranemap-demo-"};
  Wakeup wakeup_;
  std::optional<EmulatedCrane> crane_;
  std::optional<dds::Reader<dds::ServiceStatusTopic>> statuses_;
  std::optional<Supervisor> services_;
  std::set<std::uint32_t> heard_;
};

}  // namespace

int show_demo_page(const DemoPageOptions& options) {
  const auto shown = DemoPage(options).execute();
  if (shown) return static_cast<int>(kExitOk);
  log_error(shown.error().text());
  return exit_code(shown.error());
}

}  // namespace crane
