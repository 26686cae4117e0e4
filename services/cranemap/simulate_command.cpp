// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>

#include "base/log.hpp"
#include "base/read_file.hpp"
#include "commands.hpp"
#include "live_scene.hpp"
#include "progress.hpp"
#include "service/exit_code.hpp"
#include "service/run_service.hpp"
#include "sim/simulate.hpp"

namespace crane {
namespace {

struct Options {
  std::string scene;
  SimulateOptions simulate;
  long long seed = -1;
  std::vector<std::string> faults;
};

int run(Options& options) {
  const auto fail = [](const Error& error) {
    log_error(error.text());
    return exit_code(error);
  };
  auto scene = read_scene(scene_file(options.scene));
  if (!scene) return fail(scene.error());
  if (options.seed >= 0) scene->seed = static_cast<std::uint64_t>(options.seed);
  for (const std::string& text : options.faults) {
    auto fault = parse_fault(text);
    if (!fault) return fail(fault.error());
    options.simulate.faults.push_back(*fault);
  }
  const auto taken = is_there(options.simulate.folder + "/cam0");
  if (!taken) return fail(taken.error());
  if (*taken)
    return fail(Error{ErrorCode::kConfiguration, options.simulate.folder,
                      "holds a recording already", "give --out a new folder"});
  Progress progress("rendering " + scene->name);
  options.simulate.progress = [&](std::size_t done, std::size_t total) {
    progress.update(done, total, "frames");
    return !stop_requested();
  };
  if (auto done = simulate(*scene, options.simulate); !done) return fail(done.error());
  progress.finish("recording in " + options.simulate.folder);
  return kExitOk;
}

}  // namespace

Command add_simulate_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "simulate",
      "Render a scene into a recording with truth; the same seed gives the same one.\n"
      "Example: cranemap simulate shared/sim/scenes/lap.yaml --out /tmp/lap");
  command->add_option("SCENE", options->scene, "Scene file (YAML), or the name of one that ships")
      ->required();
  command->add_option("--out", options->simulate.folder, "Folder of the new recording")->required();
  command->add_option("--seed", options->seed, "Over that of the scene");
  command->add_option("--frames", options->simulate.max_frames, "Only the first N frames");
  command->add_option(
      "--fault", options->faults,
      "What is wrong with calibration or rangefinders, KIND=VALUE; repeatable.\n" + fault_kinds());
  command->add_option("--format", options->simulate.format, "Images: jpg or png")
      ->check(CLI::IsMember({"jpg", "png"}))
      ->capture_default_str();
  return [options] { return run(*options); };
}

}  // namespace crane
