// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace crane {

// Each adds a subcommand; the returned function runs it and gives the exit code.
std::function<int()> add_stereo_command(CLI::App& app);
std::function<int()> add_convert_command(CLI::App& app);
std::function<int()> add_mount_command(CLI::App& app);
/// `cranemap check` itself, not below calibrate.
std::function<int()> add_check_command(CLI::App& app);

}  // namespace crane
