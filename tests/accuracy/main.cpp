// SPDX-License-Identifier: Apache-2.0
// The accuracy report. usage: tests/accuracy/run [--out DIR] [--seeds N] [--no-sweeps]

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include "experiments.hpp"

namespace crane::accuracy {
namespace {

std::string machine() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown processor";
}

Result<void> make_report(const std::string& folder, int seeds, bool with_sweeps) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  Document document(folder, "cranemap: how exact, how fast");
  document.text("Machine: " + machine() + ", " +
                std::to_string(std::thread::hardware_concurrency()) +
                " threads. Command: tests/accuracy/run. Every number is measured in this run, by "
                "the stages that the services "
                "run, on rendered recordings whose truth is known. Unsafe: mapped lower than true; "
                "missed: mapped as floor; phantom: "
                "higher than anything nearby (shared/mapping/README.md).");
  Progress progress("accuracy");
  Bench bench{document, progress};
  bench.total = paper_experiment_steps(seeds) + kMapSizeSteps + kWatchdogSteps + (with_sweeps ? sweep_steps() : 0);
  if (auto done = paper_experiment(bench, seeds); !done) return done;
  if (auto done = map_size(bench); !done) return done;
  if (auto done = watchdog_faults(bench); !done) return done;
  if (with_sweeps)
    if (auto done = sweeps(bench); !done) return done;
  if (auto done = document.write(); !done) return done;
  progress.finish(folder + "/report.html and report.md");
  return {};
}

}  // namespace
}  // namespace crane::accuracy

int main(int argc, char** argv) {
  CLI::App app{
      "Repeats the experiment of Zhao et al. 2021 beside cranemap's own method, and sweeps\n"
      "scene, sensors and motion. Writes report.html, report.md and pictures."};
  std::string folder = "out/accuracy";
  int seeds = 10;
  bool no_sweeps = false;
  app.add_option("--out", folder, "Folder of the report")->capture_default_str();
  app.add_option("--seeds", seeds, "Repetitions of the experiment")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_flag("--no-sweeps", no_sweeps, "Only the experiment and the cost against map size");
  CLI11_PARSE(app, argc, argv);
  const auto done = crane::accuracy::make_report(folder, seeds, !no_sweeps);
  if (!done) std::fprintf(stderr, "%s\n", done.error().text().c_str());
  return done ? 0 : 3;
}
