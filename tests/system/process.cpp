// SPDX-License-Identifier: Apache-2.0
#include "process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

namespace crane::test {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

Process::Process(std::vector<std::string> command, std::string output_file)
    : output_file_(std::move(output_file)) {
  if (!command[0].starts_with('/')) command[0] = std::string(CRANEMAP_BIN_DIR) + "/" + command[0];
  std::vector<char*> arguments;
  for (std::string& a : command) arguments.push_back(a.data());
  arguments.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int file = open(output_file_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(file, 1);
    dup2(file, 2);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
}

Process::~Process() {
  if (!running()) return;
  signal(SIGTERM);
  wait(5);
}

bool Process::running() {
  if (!ended_ && waitpid(pid_, &status_, WNOHANG) == pid_) ended_ = true;
  return !ended_;
}

int Process::wait(double limit_s) {
  for (const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
       running();) {
    if (std::chrono::steady_clock::now() > end) {
      signal(SIGKILL);
      waitpid(pid_, &status_, 0);
      ended_ = true;
      return -1;
    }
    std::this_thread::sleep_for(20ms);
  }
  return WIFSIGNALED(status_) ? 128 + WTERMSIG(status_) : WEXITSTATUS(status_);
}

void Process::signal(int number) const {
  kill(pid_, number);
}

std::string Process::output() const {
  std::ifstream file(output_file_);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

Finished run(std::vector<std::string> arguments, const fs::path& folder, double limit_s) {
  arguments.insert(arguments.begin(), "cranemap");
  Process process(std::move(arguments), folder / "output.txt");
  const int code = process.wait(limit_s);
  return {code, process.output()};
}

bool eventually(std::chrono::milliseconds limit, const std::function<bool()>& condition) {
  using Steady = std::chrono::steady_clock;
  for (const auto end = Steady::now() + limit; Steady::now() < end;) {
    if (condition()) return true;
    std::this_thread::sleep_for(20ms);
  }
  return condition();
}

std::string next_domain() {
  // ctest starts one process a test: the process id tells them apart.
  static int count = 0;
  return std::to_string(10 + (getpid() * 7 + count++) % 80);
}

pid_t child_named(pid_t parent, const std::string& program) {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream stat(entry.path() / "stat");
    std::string pid, command, state;
    pid_t ppid = 0;
    stat >> pid >> command >> state >> ppid;
    if (ppid != parent || state == "Z") continue;
    std::error_code failed;
    if (fs::read_symlink(entry.path() / "exe", failed).filename() == program)
      return std::stoi(name);
  }
  return 0;
}

std::vector<std::string> shared_memory_files() {
  std::vector<std::string> out;
  for (const auto& entry : fs::directory_iterator("/dev/shm")) {
    const std::string name = entry.path().filename();
    if (name.starts_with("fast") || name.starts_with("cranemap_") ||
        name.starts_with("sem.fastrtps"))
      out.push_back(name);
  }
  return out;
}

}  // namespace crane::test
