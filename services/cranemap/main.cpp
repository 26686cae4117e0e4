// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <map>

#include "base/log.hpp"
#include "commands.hpp"
#include "dds/participant.hpp"
#include "output.hpp"
#include "service/decimal_options.hpp"
#include "service/run_service.hpp"

int main(int argc, char** argv) {
  crane::set_log_name("cranemap");
  crane::end_on_exceptions();
  crane::handle_signals();
  crane::dds::own_process();
  CLI::App app(
      "Live 3-D maps of a workshop, from a crane's stereo camera and rangefinders.\n"
      "Start with: cranemap demo",
      "cranemap");
  app.set_version_flag("--version", std::string(CRANEMAP_VERSION) + " (" CRANEMAP_BUILD_TYPE ")");
  app.require_subcommand(1);
  const std::map<std::string, crane::Command> commands = {
      {"run", crane::add_run_command(app)},
      {"demo", crane::add_demo_command(app)},
      {"simulate", crane::add_simulate_command(app)},
      {"calibrate", crane::add_calibrate_command(app)},
      {"commission", crane::add_commission_command(app)},
      {"check", crane::add_check_command(app)},
      {"watch", crane::add_watch_command(app)},
      {"evaluate", crane::add_evaluate_command(app)},
      {"query", crane::add_query_command(app)},
      {"zone", crane::add_zone_command(app)},
      {"status", crane::add_status_command(app)},
      {"health", crane::add_health_command(app)},
      {"doctor", crane::add_doctor_command(app)},
      {"config", crane::add_config_command(app)},
      {"serve", crane::add_serve_command(app)},
      {"emulate-camera", crane::add_emulate_camera_command(app)},
      {"snapshot", crane::add_snapshot_command(app)},
      {"record", crane::add_record_command(app)},
      {"emulate-crane", crane::add_emulate_crane_command(app)},
      {"emulate", crane::add_emulate_command(app)},
  };
  app.footer(
      "Exit codes: 0 done, 2 configuration or input, 3 resource, 4 data lost.\n"
      "Each command has its own --help.");
  crane::take_decimal_numbers(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return crane::exit_code_of_output(app.exit(e) == 0 ? crane::kExitOk
                                                       : crane::kExitConfiguration);
  }
  return crane::exit_code_of_output(commands.at(app.get_subcommands().front()->get_name())());
}
