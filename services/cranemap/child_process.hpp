// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// One service as a process of its own. Its log goes to a file, or to our stderr. It ends when this
/// process ends, however that happens.
class ChildProcess {
 public:
  /// Error: Resource when it cannot be started.
  static Result<ChildProcess> start(const std::vector<std::string>& command,
                                    const std::string& log_file);
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  struct Exit {
    bool by_signal = false;
    int code = 0;  ///< exit code or signal
  };
  /// How it ended, once it has.
  std::optional<Exit> poll();
  /// SIGTERM, then SIGKILL after limit_ms.
  Exit stop(int limit_ms);
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  explicit ChildProcess(pid_t pid) : pid_(pid) {}
  pid_t pid_ = -1;
  std::optional<Exit> exit_;
};

}  // namespace crane
