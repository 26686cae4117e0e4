// SPDX-License-Identifier: Apache-2.0
#include "supervisor.hpp"

#include <fstream>

#include "base/log.hpp"
#include "service/exit_code.hpp"

namespace crane {
namespace {

constexpr int kMaxRestarts = 5;

/// The last error a log tells of, or its first line.
std::string last_error(const std::string& log_file) {
  std::ifstream file(log_file);
  std::string line, last;
  while (std::getline(file, line))
    if (line.find("ERROR") != std::string::npos || last.empty()) last = line;
  return last;
}

}  // namespace

std::string Supervisor::log_of(const std::string& name) const {
  return out_ / "logs" / (name + ".log");
}

Error Supervisor::failure(const Service& service, const ChildProcess::Exit& exit) const {
  const std::string log = log_of(service.name);
  return {exit.code == kExitConfiguration && !exit.by_signal ? ErrorCode::kConfiguration
                                                             : ErrorCode::kResource,
          "cranemap-" + service.name,
          (exit.by_signal ? "was ended by signal " : "ended with exit code ") +
              std::to_string(exit.code) + ": " + last_error(log),
          "its log: " + log};
}

Result<void> Supervisor::start(const std::string& name, std::vector<std::string> arguments,
                               std::vector<std::string> when_restarted) {
  arguments.insert(arguments.begin(), programs_ / ("cranemap-" + name));
  auto process = ChildProcess::start(arguments, log_of(name));
  if (!process) return process.error();
  services_.push_back({name, std::move(arguments), std::move(when_restarted), std::move(*process)});
  return {};
}

Result<void> Supervisor::watch() {
  for (Service& s : services_) {
    const auto exit = s.process.poll();
    if (!exit || s.done) continue;
    if (!exit->by_signal && exit->code == 0) {
      s.done = true;
      continue;
    }
    if (!exit->by_signal || restarts_[s.name] == kMaxRestarts) return failure(s, *exit);
    ++restarts_[s.name];
    log_warning("cranemap-" + s.name + " was killed by signal " + std::to_string(exit->code) +
                ": starting it again");
    if (auto restarted = restart(s); !restarted) return restarted;
  }
  return {};
}

Result<void> Supervisor::restart(Service& s) {
  std::vector<std::string> command = s.command;
  command.insert(command.end(), s.when_restarted.begin(), s.when_restarted.end());
  auto process = ChildProcess::start(command, log_of(s.name));
  if (!process) return process.error();
  s.process = std::move(*process);
  s.done = false;
  return {};
}

Result<void> Supervisor::start_again(const std::string& name) {
  for (Service& s : services_) {
    if (s.name != name) continue;
    s.process.stop(5000);
    return restart(s);
  }
  return {};
}

bool Supervisor::ended(const std::string& name) const {
  for (const Service& s : services_)
    if (s.name == name) return s.done;
  return true;
}

Result<void> Supervisor::stop(const std::string& name, int limit_ms) {
  for (Service& s : services_) {
    if (s.name != name) continue;
    const ChildProcess::Exit exit = s.process.stop(limit_ms);
    s.done = true;
    if (exit.by_signal || exit.code != 0) return failure(s, exit);
  }
  return {};
}

}  // namespace crane
