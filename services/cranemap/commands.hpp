// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace crane {

/// Each adds a subcommand; the returned function runs it and gives the exit code.
using Command = std::function<int()>;
Command add_run_command(CLI::App& app);
Command add_demo_command(CLI::App& app);
Command add_simulate_command(CLI::App& app);
Command add_commission_command(CLI::App& app);
Command add_calibrate_command(CLI::App& app);
Command add_check_command(CLI::App& app);
Command add_emulate_camera_command(CLI::App& app);
Command add_emulate_crane_command(CLI::App& app);
Command add_record_command(CLI::App& app);
Command add_snapshot_command(CLI::App& app);
Command add_watch_command(CLI::App& app);
Command add_evaluate_command(CLI::App& app);
Command add_query_command(CLI::App& app);
Command add_health_command(CLI::App& app);
Command add_doctor_command(CLI::App& app);
Command add_config_command(CLI::App& app);
Command add_serve_command(CLI::App& app);
Command add_status_command(CLI::App& app);
Command add_zone_command(CLI::App& app);
Command add_emulate_command(CLI::App& app);

}  // namespace crane
