// SPDX-License-Identifier: Apache-2.0
#include "child_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

namespace crane {

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& command,
                                         const std::string& log_file) {
  expects(!command.empty(), "a program to start");
  if (access(command[0].c_str(), X_OK) != 0)
    return Error{ErrorCode::kResource, command[0], "cannot be executed",
                 "build or install all services beside cranemap"};
  const int log = log_file.empty()
                      ? fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3)
                      : open(log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log < 0)
    return Error{ErrorCode::kResource, log_file, "cannot be written",
                 "check permissions and free space"};
  std::vector<char*> arguments;
  for (const std::string& a : command) arguments.push_back(const_cast<char*>(a.c_str()));
  arguments.push_back(nullptr);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(1);  // the parent ended before prctl
    setpgid(0, 0);  // Ctrl-C reaches cranemap only, which then stops the children
    dup2(log, STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  close(log);
  if (pid < 0)
    return Error{ErrorCode::kResource, command[0], std::strerror(errno), "too many processes?"};
  return ChildProcess(pid);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), exit_(other.exit_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(exit_, other.exit_);
  return *this;
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0 && !exit_) stop(2000);
}

std::optional<ChildProcess::Exit> ChildProcess::poll() {
  if (exit_ || pid_ <= 0) return exit_;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) == pid_)
    exit_ = WIFSIGNALED(status) ? Exit{true, WTERMSIG(status)} : Exit{false, WEXITSTATUS(status)};
  return exit_;
}

ChildProcess::Exit ChildProcess::stop(int limit_ms) {
  if (!poll()) kill(pid_, SIGTERM);
  for (int waited = 0; !poll(); waited += 10) {
    if (waited == limit_ms) kill(pid_, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return *exit_;
}

}  // namespace crane
