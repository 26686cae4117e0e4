// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/log.hpp"
#include "calibrate_command.hpp"
#include "output.hpp"
#include "service/decimal_options.hpp"
#include "service/exit_code.hpp"
#include "service/run_service.hpp"

// A program of its own, which `cranemap calibrate` becomes: what solves calibrations takes longer
// to load than most other commands to run.
int main(int argc, char** argv) {
  crane::set_log_name("cranemap");
  crane::end_on_exceptions();
  crane::handle_signals();
  // `cranemap check` comes as `cranemap-calibrate check`.
  const bool check = argc > 1 && std::string(argv[1]) == "check";
  CLI::App app("Find what the cameras are, how they hang, and how surely.",
               check ? "cranemap" : "cranemap calibrate");
  app.require_subcommand(1);
  std::vector<std::pair<std::string, std::function<int()>>> commands;
  if (check) {
    commands.emplace_back("check", crane::add_check_command(app));
  } else {
    commands.emplace_back("stereo", crane::add_stereo_command(app));
    commands.emplace_back("mount", crane::add_mount_command(app));
    commands.emplace_back("convert", crane::add_convert_command(app));
  }
  crane::take_decimal_numbers(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return crane::exit_code_of_output(app.exit(e) == 0 ? crane::kExitOk
                                                       : crane::kExitConfiguration);
  }
  for (const auto& [name, run] : commands)
    if (app.got_subcommand(name)) return crane::exit_code_of_output(run());
  return crane::kExitConfiguration;
}
