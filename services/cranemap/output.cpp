// SPDX-License-Identifier: Apache-2.0
#include "output.hpp"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <iostream>
#include <system_error>

#include "base/log.hpp"
#include "service/exit_code.hpp"

namespace crane {
namespace {

/// Of the first failed write; a stream keeps only that there was one.
int& why_lost() {
  static int why = 0;
  return why;
}

}  // namespace

bool flush_output() {
  errno = 0;
  std::cout.flush();
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    if (why_lost() == 0) why_lost() = errno != 0 ? errno : EIO;
    return false;
  }
  pollfd out{STDOUT_FILENO, 0, 0};
  const bool left = poll(&out, 1, 0) == 1 && (out.revents & (POLLERR | POLLHUP)) != 0;
  if (left && why_lost() == 0) why_lost() = EPIPE;
  return !left;
}

int exit_code_of_output(int code) {
  if (flush_output() || why_lost() == EPIPE) return code;
  // A write that failed within printf may have left no reason behind.
  log_error("standard output: cannot be written: " + std::generic_category().message(why_lost()) +
            " -> check free space");
  return code == kExitOk ? kExitResource : code;
}

}  // namespace crane
