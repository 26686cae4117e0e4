// SPDX-License-Identifier: Apache-2.0
#include "recording/time_check.hpp"

#include <cstdio>
#include <ctime>

namespace crane {
namespace {

constexpr TimeNs kLongestStep = 3600 * kNsPerSecond;
constexpr TimeNs kShortestStep = 2'000'000;  ///< no camera of a crane is faster than 500 Hz

std::string span_text(TimeNs span) {
  const double hours = double(span) / (3600.0 * kNsPerSecond);
  char text[48];
  if (hours < 48)
    std::snprintf(text, sizeof text, "%.1f hours", hours);
  else if (hours < 24 * 730.0)
    std::snprintf(text, sizeof text, "%.0f days", hours / 24);
  else
    std::snprintf(text, sizeof text, "%.1f years", hours / 24 / 365.25);
  return text;
}

}  // namespace

std::string utc_text(TimeNs time) {
  const std::time_t seconds = time / kNsPerSecond;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &utc);
  return text;
}

Result<void> TimeCheck::add(TimeNs time) {
  if (count_ > 0 && time - last_ > kLongestStep)
    return Error{ErrorCode::kBadData, file_,
                 "its time jumps by " + span_text(time - last_) + ", from " +
                     std::to_string(last_) + " (" + utc_text(last_) + ") to " +
                     std::to_string(time) + " (" + utc_text(time) + ")",
                 "remove the lines from before the device's clock was set, or split the recording"};
  if (count_ == 0) first_ = time;
  last_ = time;
  ++count_;
  return {};
}

Result<void> TimeCheck::check_with(const TimeCheck& other) const {
  if (count_ == 0 || other.count_ == 0) return {};
  const TimeNs apart = first_ > other.last_ ? first_ - other.last_ : other.first_ - last_;
  if (apart <= kLongestStep) return {};
  return Error{ErrorCode::kBadData, file_,
               "its times (from " + utc_text(first_) + ") are " + span_text(apart) +
                   " away from those of " + other.file_ + " (from " + utc_text(other.first_) + ")",
               "was its clock set? All sensors need the same clock"};
}

Result<void> TimeCheck::check_unit() const {
  if (count_ < 2 || (last_ - first_) / (count_ - 1) >= kShortestStep) return {};
  return Error{ErrorCode::kBadData, file_,
               std::to_string(count_) + " times within " + std::to_string(last_ - first_) +
                   " ns are no nanoseconds",
               "write nanoseconds since 1970, not seconds, milliseconds or microseconds"};
}

}  // namespace crane
