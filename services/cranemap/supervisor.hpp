// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "child_process.hpp"

namespace crane {

/// The services of one run as processes: started, watched, started again when killed. Their logs
/// are in `out`/logs.
class Supervisor {
 public:
  /// `programs`: folder of the programs cranemap-<name>.
  Supervisor(std::filesystem::path programs, std::filesystem::path out)
      : programs_(std::move(programs)), out_(std::move(out)) {}

  /// Starts cranemap-<name>; after a kill it is started with `when_restarted` added.
  Result<void> start(const std::string& name, std::vector<std::string> arguments,
                     std::vector<std::string> when_restarted);
  /// Stops it, if it still runs, and starts it once more. Error: Resource.
  Result<void> start_again(const std::string& name);
  /// Starts again what died by a signal. Error: a service that ended by itself with a failure, or
  /// is killed again and again.
  Result<void> watch();
  /// True when it ended well by itself, or was stopped.
  [[nodiscard]] bool ended(const std::string& name) const;
  /// SIGTERM, SIGKILL after limit_ms. Error: it did not end well.
  Result<void> stop(const std::string& name, int limit_ms);
  /// How often each service that was killed was started again.
  [[nodiscard]] const std::map<std::string, int>& restarts() const { return restarts_; }

 private:
  struct Service {
    std::string name;
    std::vector<std::string> command, when_restarted;
    ChildProcess process;
    bool done = false;
  };
  Result<void> restart(Service& service);
  [[nodiscard]] std::string log_of(const std::string& name) const;
  [[nodiscard]] Error failure(const Service& service, const ChildProcess::Exit& exit) const;

  std::filesystem::path programs_, out_;
  std::vector<Service> services_;
  std::map<std::string, int> restarts_;
};

}  // namespace crane
