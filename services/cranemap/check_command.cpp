// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <thread>

#include "base/log.hpp"
#include "base/read_file.hpp"
#include "calibrate_command.hpp"
#include "child_process.hpp"
#include "mount/commissioning.hpp"
#include "mount/mount_files.hpp"
#include "mount_input.hpp"
#include "recording/calibration.hpp"
#include "service/exit_code.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

/// Of this command: something has changed; nothing could be compared.
constexpr int kExitChanged = 1, kExitNotMeasured = 4;

struct Options {
  std::string recording, site, commissioning, lasts = "60s";
};

int fail(const Error& error) {
  log_error(error.text());
  return exit_code(error);
}

int report(const std::vector<CheckedItem>& items, const MountCalibration& now) {
  std::size_t changed = 0, same = 0;
  for (const CheckedItem& item : items) {
    static constexpr const char* kState[] = {"same", "CHANGED", "?"};
    std::printf("%-8s %s\n", kState[static_cast<int>(item.state)], item.text.c_str());
    if (item.state == CheckState::kChanged) ++changed;
    if (item.state == CheckState::kSame) ++same;
  }
  if (changed > 0) {
    std::printf("%zu of %zu have changed since the day of commissioning\n", changed, items.size());
    return kExitChanged;
  }
  if (same == 0) {
    for (const std::string& remark : now.remarks) std::printf("  - %s\n", remark.c_str());
    std::printf("nothing could be measured: record a drive of bridge and trolley\n");
    return kExitNotMeasured;
  }
  std::printf("%zu measured, all as on the day of commissioning; %zu not measured\n", same,
              items.size() - same);
  return kExitOk;
}

int compare_with(const Options& o, const std::string& recording) {
  const std::string& folder = o.site.empty() ? recording : o.site;
  const std::string file =
      o.commissioning.empty() ? folder + "/commissioning.yaml" : o.commissioning;
  const auto then = read_commissioning(file);
  if (!then) return fail(then.error());
  const auto site = site_of_recording(recording, o.site.empty() ? "" : o.site + "/site.yaml");
  if (!site) return fail(site.error());
  const auto drive = drive_of(recording, o.site);
  if (!drive) return fail(drive.error());
  MountOptions options;
  options.told = site->mapper;
  options.cart_direction = site->mapper.cart_direction;
  const MountCalibration now = of_devices(calibrate_mount(*drive, options), *site);
  return report(compare(*then, now), now);
}

/// A recording of the live topics, by `cranemap record`, removed afterwards.
int check_live(const Options& o) {
  std::error_code failed;
  const fs::path folder =
      fs::temp_directory_path(failed) / ("cranemap-check-" + std::to_string(getpid()));
  const fs::path self = fs::read_symlink("/proc/self/exe", failed);
  const std::string program = self.parent_path() / "cranemap";
  std::printf("drive bridge and trolley now, there and back, for %s\n", o.lasts.c_str());
  std::fflush(stdout);
  auto child = ChildProcess::start(
      {program, "record", "--site", o.site, "--out", folder, "--for", o.lasts}, "");
  if (!child) return fail(child.error());
  std::optional<ChildProcess::Exit> ended;
  while (!(ended = child->poll()))
    if (stop_requested())
      ended = child->stop(5000);
    else
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const bool recorded = !ended->by_signal && ended->code == kExitOk;
  const int code = recorded ? compare_with(o, folder)
                            : fail(Error{ErrorCode::kNotAvailable, "cranemap record",
                                         "made no recording", "see above; cranemap doctor"});
  fs::remove_all(folder, failed);
  return code;
}

}  // namespace

std::function<int()> add_check_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* check = app.add_subcommand(
      "check",
      "Measures again, in service, what was measured when the crane was commissioned, and says\n"
      "what has changed, by how much, and what to do. 0: all as then, 1: something has changed,\n"
      "4: nothing could be measured.\n"
      "Examples: cranemap check --site deploy/sites/crane-1 --for 60s    (live; drive meanwhile)\n"
      "          cranemap check drive --site deploy/sites/crane-1");
  check->add_option("RECORDING", options->recording, "Of a drive in service; without it: live");
  check->add_option("--site", options->site,
                    "Folder of the crane: its calibration, site.yaml and commissioning.yaml");
  check->add_option("--commissioning", options->commissioning,
                    "File to compare with; default: commissioning.yaml of the site");
  check->add_option("--for", options->lasts, "How long is recorded, live")->capture_default_str();
  return [options] {
    if (options->recording.empty() && options->site.empty())
      return fail(Error{ErrorCode::kConfiguration, "check", "needs a RECORDING or --site DIR", ""});
    return options->recording.empty() ? check_live(*options)
                                      : compare_with(*options, options->recording);
  };
}

}  // namespace crane
