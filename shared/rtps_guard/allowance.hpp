// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

namespace crane::guard {

using Clock = std::chrono::steady_clock;

/// So many at once, and so many a second again.
class Allowance {
 public:
  constexpr Allowance(double at_once, double per_second)
      : at_once_(at_once), per_second_(per_second), left_(at_once) {}

  [[nodiscard]] double left(Clock::time_point now) const {
    if (filled_ == Clock::time_point{}) return left_;
    const double passed_s = std::chrono::duration<double>(now - filled_).count();
    return std::min(at_once_, left_ + passed_s * per_second_);
  }
  [[nodiscard]] bool is_full(Clock::time_point now) const { return left(now) >= at_once_; }
  /// Takes all of it, or nothing.
  bool take(Clock::time_point now, double wanted = 1) {
    const double there = left(now);
    if (there < wanted) return false;
    left_ = there - wanted;
    filled_ = now;
    return true;
  }

 private:
  double at_once_, per_second_, left_;
  Clock::time_point filled_{};
};

}  // namespace crane::guard
