// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "base/log.hpp"
#include "commands.hpp"
#include "service/exit_code.hpp"

namespace crane {
namespace {

/// Becomes cranemap-calibrate, the program beside this one, with the rest of the command line.
int become_calibrate(const std::vector<std::string>& first, const std::vector<std::string>& rest) {
  std::error_code failed;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", failed);
  const std::string program = self.parent_path() / "cranemap-calibrate";
  std::vector<std::string> words = {program};
  words.insert(words.end(), first.begin(), first.end());
  words.insert(words.end(), rest.begin(), rest.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execv(program.c_str(), arguments.data());
  log_error(program + ": cannot be started -> it belongs beside cranemap: install both");
  return kExitResource;
}

}  // namespace

Command add_calibrate_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "calibrate",
      "Find what the cameras are, from images of a board, and how they hang, from a drive; and how "
      "surely.\n"
      "Example: cranemap calibrate stereo images --board chessboard:9x6:0.025 --height 9.4 --out "
      "calibration\n"
      "         cranemap calibrate mount drive --calibration calibration --out "
      "deploy/sites/crane-1");
  command->alias("calibration");  // 'cranemap calibration convert' reads better
  command->set_help_flag();       // its own program tells
  command->prefix_command();
  return [command] { return become_calibrate({}, command->remaining()); };
}

Command add_check_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "check",
      "Measure again in service what was measured at commissioning: what has changed?\n"
      "Example: cranemap check --site deploy/sites/crane-1 --for 60s");
  command->set_help_flag();  // its own program tells
  command->prefix_command();
  return [command] { return become_calibrate({"check"}, command->remaining()); };
}

}  // namespace crane
