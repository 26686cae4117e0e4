// SPDX-License-Identifier: Apache-2.0
#include "base/line_writer.hpp"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <thread>
#include <utility>

#include "base/loop_watch.hpp"

namespace crane {
namespace {

/// All of it, or as much as the other end takes before it is gone.
void write_all(int fd, const std::string& line) {
  for (std::size_t at = 0; at < line.size();) {
    const ssize_t n = write(fd, line.data() + at, line.size() - at);
    if (n > 0) {
      at += static_cast<std::size_t>(n);
    } else if (n < 0 && errno == EAGAIN) {  // somebody made it non-blocking
      pollfd wait{fd, POLLOUT, 0};
      poll(&wait, 1, -1);
    } else if (n == 0 || errno != EINTR) {
      return;
    }
  }
}

}  // namespace

LineWriter::LineWriter(int fd, std::size_t most_lines,
                       std::function<std::string(std::uint64_t)> said)
    : fd_(fd), most_lines_(most_lines), said_(std::move(said)) {}

void LineWriter::begin() {
  // Signals are for the program's own threads.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    std::thread([this] { run(); }).detach();
    begun_ = true;
  } catch (const std::system_error&) {  // no more threads: lines wait until there may be one
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void LineWriter::put(std::string line) {
  const std::lock_guard lock(mutex_);
  if (lines_.size() >= most_lines_) {
    ++left_out_;
    ++unsaid_;
    return;
  }
  if (!begun_) begin();
  if (unsaid_ > 0) lines_.push_back(said_(std::exchange(unsaid_, 0)));
  lines_.push_back(std::move(line));
  more_.notify_one();
}

bool LineWriter::flush(std::chrono::milliseconds limit) {
  std::unique_lock lock(mutex_);
  return less_.wait_for(lock, limit, [this] { return lines_.empty() && !writing_; });
}

std::uint64_t LineWriter::left_out() const {
  const std::lock_guard lock(mutex_);
  return left_out_;
}

void LineWriter::run() {
  name_thread("log");
  std::unique_lock lock(mutex_);
  for (;;) {
    more_.wait(lock, [this] { return !lines_.empty(); });
    const std::string line = std::move(lines_.front());
    lines_.pop_front();
    writing_ = true;
    lock.unlock();
    write_all(fd_, line);
    lock.lock();
    writing_ = false;
    if (lines_.empty()) {
      // Not with the next line, which may never come.
      if (unsaid_ > 0) lines_.push_back(said_(std::exchange(unsaid_, 0)));
      less_.notify_all();
    }
  }
}

}  // namespace crane
