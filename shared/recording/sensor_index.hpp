// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"

namespace crane {

/// A data.csv that grows: whole lines, or none, also on a disk that fills up or after a kill. What
/// could not be written is tried again with the next flush().
class SensorIndex {
 public:
  /// `path`: of the new file; its folder is made. `header`: its first line, without line end.
  /// Error: Resource.
  static Result<SensorIndex> create(const std::string& path, const std::string& header,
                                    bool shrinks);
  ~SensorIndex();
  SensorIndex(SensorIndex&& other) noexcept;
  SensorIndex& operator=(SensorIndex&&) = delete;

  void add(TimeNs time, std::string text);
  /// Only where it shrinks: lines of before `time`, but for the last one, are gone with the next
  /// flush().
  void drop_before(TimeNs time);
  /// Error: Resource; the file is as it was after the last good one.
  Result<void> flush();
  /// Lines in memory: not yet written, or all of them where it shrinks.
  [[nodiscard]] std::size_t held() const { return lines_.size(); }

 private:
  SensorIndex(std::string path, std::string header, bool shrinks)
      : path_(std::move(path)), header_(std::move(header)), shrinks_(shrinks) {}
  Result<void> append();
  Result<void> replace();

  struct Line {
    TimeNs time;
    std::string text;
  };
  std::string path_, header_;
  bool shrinks_ = false, changed_ = true;
  int file_ = -1;
  std::int64_t good_bytes_ = 0;
  std::deque<Line> lines_;
};

}  // namespace crane
