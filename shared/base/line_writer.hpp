// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>

namespace crane {

/// Writes lines to a file descriptor in a thread of its own, so that a pipe that nobody reads holds
/// up no other. Bounded: what has no room is left out, the newest first, and how many were is said
/// once there is room. Never destroyed: its thread may be in a write() that does not end.
class LineWriter {
 public:
  /// `said`: makes a line out of how many were left out.
  LineWriter(int fd, std::size_t most_lines, std::function<std::string(std::uint64_t)> said);
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  /// Any thread; returns at once. `line` ends with a line end.
  void put(std::string line);
  /// False when not all was written within the limit.
  bool flush(std::chrono::milliseconds limit);
  [[nodiscard]] std::uint64_t left_out() const;

 private:
  void begin();
  void run();

  int fd_;
  std::size_t most_lines_;
  std::function<std::string(std::uint64_t)> said_;
  mutable std::mutex mutex_;
  std::condition_variable more_, less_;
  std::deque<std::string> lines_;
  bool writing_ = false, begun_ = false;
  std::uint64_t left_out_ = 0, unsaid_ = 0;
};

}  // namespace crane
