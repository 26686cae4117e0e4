// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"

namespace crane {

/// The times of one sensor, first to last, as they grow line by line.
class TimeCheck {
 public:
  explicit TimeCheck(std::string file) : file_(std::move(file)) {}

  /// Error: BadData at a step of more than an hour: what stands before or after it has the stamps
  /// of a clock that was not set yet, and a play would wait for years.
  Result<void> add(TimeNs time);
  /// Error: BadData when this sensor was on at another time than `other`, by more than an hour.
  [[nodiscard]] Result<void> check_with(const TimeCheck& other) const;
  /// Error: BadData when there are more than 500 times a second: they are no nanoseconds.
  [[nodiscard]] Result<void> check_unit() const;

 private:
  std::string file_;
  TimeNs first_ = 0, last_ = 0;
  std::int64_t count_ = 0;
};

/// "1970-01-01 00:00:05".
std::string utc_text(TimeNs time);

}  // namespace crane
