// SPDX-License-Identifier: Apache-2.0
#include "child_output.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include "child_process.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

constexpr int kStopMs = 5000;
constexpr const char* kError = " ERROR ";
constexpr const char* kBrokenOff = "commission";

ChildOutput understood(const std::string& log, int code) {
  ChildOutput out;
  out.code = code;
  std::ifstream file(log);
  bool in_error = false;
  for (std::string line; std::getline(file, line);) {
    const auto at = line.find(kError);
    if (at != std::string::npos) {
      in_error = true;
      out.error = line.substr(at + std::string(kError).size());
    } else if (in_error && line.starts_with("  ")) {
      out.error += "\n" + line;
    } else {
      in_error = false;
      out.lines.push_back(line);
    }
  }
  // The name of the program comes first in each line of a log.
  if (out.error.starts_with("cranemap")) out.error = out.error.substr(out.error.find(": ") + 2);
  if (const auto arrow = out.error.rfind(" -> "); arrow != std::string::npos) {
    out.advice = out.error.substr(arrow + 4);
    out.error.resize(arrow);
  }
  return out;
}

}  // namespace

Error broken_off() {
  return {ErrorCode::kNotAvailable, kBrokenOff, "is broken off",
          "the same command goes on where it was"};
}

bool is_broken_off(const Error& error) {
  return error.where == kBrokenOff;
}

std::string own_program() {
  std::error_code failed;
  return std::filesystem::read_symlink("/proc/self/exe", failed);
}

Result<ChildOutput> run_cranemap(std::vector<std::string> arguments, const std::string& log,
                                 bool shown) {
  std::error_code ignored;
  std::filesystem::remove(log, ignored);
  arguments.insert(arguments.begin(), own_program());
  auto process = ChildProcess::start(arguments, log);
  if (!process) return process.error();
  std::ifstream follow;
  const auto show = [&] {
    if (!shown) return;
    if (!follow.is_open()) follow.open(log);
    for (std::string line; std::getline(follow, line);) std::printf("    %s\n", line.c_str());
    follow.clear();
    std::fflush(stdout);
  };
  std::optional<ChildProcess::Exit> exit;
  while (!(exit = process->poll())) {
    if (stop_requested()) {
      process->stop(kStopMs);
      return broken_off();
    }
    show();
    std::this_thread::sleep_for(50ms);
  }
  show();
  return understood(log, exit->by_signal ? 128 + exit->code : exit->code);
}

}  // namespace crane
