// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace crane::test {

/// A real process of ours, its output in a file. Ended with the object.
class Process {
 public:
  /// `command[0]`: a program of the build, e.g. "cranemap", or a whole path.
  Process(std::vector<std::string> command, std::string output_file);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Exit code; 128 + signal; -1 after limit_s, when it is killed.
  int wait(double limit_s);
  void signal(int number) const;
  [[nodiscard]] bool running();
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] std::string output() const;

 private:
  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
  std::string output_file_;
};

/// Runs `cranemap ...` to its end.
struct Finished {
  int code = 0;
  std::string output;
};
Finished run(std::vector<std::string> arguments, const std::filesystem::path& folder,
             double limit_s = 120);

/// Waits for a condition.
bool eventually(std::chrono::milliseconds limit, const std::function<bool()>& condition);

/// A domain of its own for each call, so that tests never meet.
std::string next_domain();

/// Process ids of the services that a `cranemap run` started, by name ("cranemap-stereo").
pid_t child_named(pid_t parent, const std::string& program);

/// What Fast DDS and we leave in /dev/shm.
std::vector<std::string> shared_memory_files();

}  // namespace crane::test
