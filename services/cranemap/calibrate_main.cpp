// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <map>

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
  CLI::App app("Find what the cameras are, and how surely.", "cranemap calibrate");
  app.require_subcommand(1);
  const std::map<std::string, std::function<int()>> commands = {
      {"stereo", crane::add_stereo_command(app)},
      {"convert", crane::add_convert_command(app)},
  };
  crane::take_decimal_numbers(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return crane::exit_code_of_output(app.exit(e) == 0 ? crane::kExitOk
                                                       : crane::kExitConfiguration);
  }
  return crane::exit_code_of_output(commands.at(app.get_subcommands().front()->get_name())());
}
