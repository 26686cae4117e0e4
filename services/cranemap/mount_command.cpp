// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <filesystem>

#include "base/log.hpp"
#include "base/read_file.hpp"
#include "calibrate_command.hpp"
#include "config/site_config.hpp"
#include "mount/mount_files.hpp"
#include "mount_input.hpp"
#include "recording/calibration.hpp"
#include "service/exit_code.hpp"

namespace crane {
namespace {

struct Options {
  std::string recording, calibration, config, out;
  std::vector<std::string> targets;
  std::vector<double> start_m;
  int cart_direction = 0;
  double hook_m = 0;
};

int fail(const Error& error) {
  log_error(error.text());
  return exit_code(error);
}

Result<MountOptions> options_of(const Options& o, const SiteConfig& site) {
  MountOptions options;
  options.told = site.mapper;
  if (o.cart_direction != 0) options.cart_direction = o.cart_direction;
  if (o.start_m.size() == 2) options.start_m = Eigen::Vector2d(o.start_m[0], o.start_m[1]);
  if (o.hook_m > 0) options.hook_height_m = o.hook_m;
  for (const std::string& text : o.targets) {
    auto target = parse_floor_target(text);
    if (!target) return target.error();
    options.targets.push_back(*target);
  }
  return options;
}

int run(const Options& o) {
  const auto taken = is_there(o.out + "/rig.yaml");
  if (!taken) return fail(taken.error());
  if (*taken)
    return fail(Error{ErrorCode::kConfiguration, o.out, "holds a calibration already",
                      "give --out a new folder"});
  const auto site = site_of_recording(o.recording, o.config);
  if (!site) return fail(site.error());
  const auto options = options_of(o, *site);
  if (!options) return fail(options.error());
  const auto drive = drive_of(o.recording, o.calibration);
  if (!drive) return fail(drive.error());
  const MountCalibration c = calibrate_mount(*drive, *options);
  const auto text = site_text(o.recording, o.config);
  if (!text) return fail(text.error());
  if (auto done = write_mount(c, *site, *text, o.recording, o.out); !done)
    return fail(done.error());
  std::printf("%s", mount_text(c).c_str());
  if (c.verdict == MountVerdict::kBad)
    return fail(Error{ErrorCode::kBadData, o.recording,
                      "gives no mount that a map may be made with",
                      "do what is said above; report in " + o.out + "/mount.html"});
  std::printf("site in %s (rig.yaml, site.yaml, commissioning.yaml), report in %s/mount.html\n",
              o.out.c_str(), o.out.c_str());
  return kExitOk;
}

}  // namespace

std::function<int()> add_mount_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* mount = app.add_subcommand(
      "mount",
      "How the camera hangs and what the rangefinders' readings mean, from a short drive over any\n"
      "textured floor, with how surely.\n"
      "Drive 30 to 60 s: begin at rest, bridge and trolley one after the other and together, 1 m\n"
      "or more, there and back, with stops and different speeds; floor free, hook up, nobody "
      "below.\n"
      "Live: cranemap record --site DIR --out drive --for 60s, then calibrate the recording.\n"
      "Example: cranemap calibrate mount drive --calibration calibration --start 2.0,1.5 "
      "--floor-target 3.2,1.5,0.45 --out deploy/sites/crane-1");
  mount->add_option("RECORDING", options->recording, "Of the drive")->required();
  mount->add_option("--calibration", options->calibration,
                    "Folder of 'calibrate stereo'; default: as the recording says");
  mount->add_option("--config", options->config,
                    "Site file that is kept beside what is measured; default: the recording's own");
  mount->add_option("--out", options->out, "Folder of the site: serve --site takes it")->required();
  mount->add_option("--floor-target", options->targets,
                    "X,Y,H [m]: a thing of known height, a check that is not used; repeatable");
  mount
      ->add_option("--start", options->start_m,
                   "X,Y [m, map]: where bridge and trolley stood at the beginning; gives offsets")
      ->delimiter(',')
      ->expected(2);
  mount
      ->add_option("--bridge-direction", options->cart_direction,
                   "1: map x grows with the bridge's readings, -1: against them; default: as the\n"
                   "camera's rig.yaml says")
      ->check(CLI::IsMember({1, -1}));
  mount
      ->add_option("--hook-height", options->hook_m,
                   "Of the hook's lowest point above the floor all the while [m]; gives where it "
                   "hangs at rest")
      ->check(CLI::Range(0.05, 100.0));
  return [options] { return run(*options); };
}

}  // namespace crane
