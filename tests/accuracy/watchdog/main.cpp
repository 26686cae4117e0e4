// SPDX-License-Identifier: Apache-2.0
// What the watchdog makes of scenes and recordings, with and without faults.

#include <CLI/CLI.hpp>
#include <cstdio>

#include "sim/simulate.hpp"
#include "temp_folder.hpp"
#include "watch_trial.hpp"

namespace crane::accuracy {
namespace {

struct Options {
  std::vector<std::string> scenes, recordings, faults;
  std::size_t most_frames = 100;
  double speed_mps = 0;
  bool each_frame = false;
};

void tell(std::size_t n, const MappingPipeline& pipeline) {
  const Watchdog& w = pipeline.watchdog();
  const FloorWatch::Finding& f = w.floor();
  const auto& m = w.motion();
  const auto say = [](const char* name, const Figure& figure, double unit) {
    if (figure.known())
      std::printf(" %s %.2f+-%.2f", name, figure.value * unit, figure.sigma * unit);
  };
  constexpr double kDeg = 57.29578;
  std::printf("  %3zu", n);
  say("h_mm", f.height_m, 1000);
  say("bend_mm", f.bend_m, 1000);
  say("tx", f.slope_x, kDeg), say("ty", f.slope_y, kDeg);
  say("sx", f.seen_slope_x, kDeg), say("sy", f.seen_slope_y, kDeg);
  for (const int i : {0, 1}) {
    const AxisFit& a = m[static_cast<std::size_t>(i)];
    std::printf(" |%s", i == 0 ? "X" : "Y");
    say("s%", a.scale, 100), say("t", a.turn, kDeg), say("ms", a.delay_s, 1000);
    std::printf(" r%.1f", a.rest_m * 1000);
  }
  const RowError& r = w.rows();
  std::printf(" |rows %u %.2f %.3fdeg %.4f", r.patches, r.offset_px, r.roll_rad * kDeg, r.slope);
  const auto refused = pipeline.report().refused;
  std::printf(" [%zu] %d %s %s\n", w.motion_samples(), int(w.state()), name_of(w.worst().suspect),
              refused ? std::string(cause_text(*refused)).c_str() : "");
}

int run_one(const std::string& name, const Recording& recording, const Options& options) {
  std::vector<std::string> sets = options.faults;
  if (sets.empty()) sets = {""};
  for (const std::string& set : sets) {
    std::vector<Fault> faults;
    for (std::size_t from = 0; from < set.size();) {
      const std::size_t end = std::min(set.find(',', from), set.size());
      auto fault = parse_fault(set.substr(from, end - from));
      if (!fault) {
        std::fprintf(stderr, "%s\n", fault.error().text().c_str());
        return 2;
      }
      faults.push_back(*fault);
      from = end + 1;
    }
    const auto outcome =
        options.each_frame ? watch(recording, faults, tell) : watch(recording, faults);
    if (!outcome) {
      std::fprintf(stderr, "%s: %s\n", name.c_str(), outcome.error().text().c_str());
      return 3;
    }
    constexpr const char* kStates[] = {"fine", "drifting", "wrong"};
    std::printf("| %s | %s | %s | %s | %d | %d | %.1f | %zu/%zu | %.2f | %s |\n", name.c_str(),
                set.c_str(), kStates[int(outcome->state)], name_of(outcome->misfit.suspect),
                outcome->drifting_after, outcome->wrong_after, outcome->wrong_after_s,
                outcome->used, outcome->frames, outcome->watch_ms,
                outcome->state == WatchState::kFine ? "" : text_of(outcome->misfit).c_str());
    std::fflush(stdout);
  }
  return 0;
}

int run(const Options& options) {
  std::printf(
      "| scene | fault | state | named | drifting after frame | wrong after frame | after [s] | "
      "frames used | watch [ms] | said |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const std::string& file : options.scenes) {
    auto scene = read_scene(file);
    if (!scene) {
      std::fprintf(stderr, "%s\n", scene.error().text().c_str());
      return 2;
    }
    if (options.speed_mps > 0) scene->motion.speed_mps = options.speed_mps;
    const test::TempFolder folder;
    SimulateOptions simulation;
    simulation.folder = folder / "recording";
    simulation.max_frames = options.most_frames;
    const auto faults = std::move(scene->faults);
    scene->faults.clear();
    if (auto done = simulate(*scene, simulation); !done) return 3;
    const auto recording = Recording::open(simulation.folder);
    if (!recording) return 3;
    if (const int code = run_one(scene->name, *recording, options); code != 0) return code;
  }
  for (const std::string& folder : options.recordings) {
    const auto recording = Recording::open(folder);
    if (!recording) {
      std::fprintf(stderr, "%s\n", recording.error().text().c_str());
      return 3;
    }
    if (const int code = run_one(folder, *recording, options); code != 0) return code;
  }
  return 0;
}

}  // namespace
}  // namespace crane::accuracy

int main(int argc, char** argv) {
  CLI::App app{"Plays scenes and recordings to the watchdog, in this process."};
  crane::accuracy::Options options;
  app.add_option("--scene", options.scenes, "Scene file; repeatable");
  app.add_option("--recording", options.recordings, "Recording; repeatable");
  app.add_option("--fault", options.faults,
                 "KIND=VALUE[,KIND=VALUE], each set a run of its own; repeatable");
  app.add_option("--frames", options.most_frames, "Of a scene, at most")->capture_default_str();
  app.add_option("--speed", options.speed_mps, "Of a lap, instead of the scene's [m/s]");
  app.add_flag("--each-frame", options.each_frame, "All figures after each frame");
  CLI11_PARSE(app, argc, argv);
  return crane::accuracy::run(options);
}
