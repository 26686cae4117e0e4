// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

namespace crane {

/// Nanoseconds since the Unix epoch, of the *measurement* unless said otherwise.
using TimeNs = std::int64_t;

inline constexpr TimeNs kNsPerSecond = 1'000'000'000;

/// Where stages get their time from, so that tests can decide it.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual TimeNs now() const = 0;
};

class SystemClock final : public Clock {
 public:
  [[nodiscard]] TimeNs now() const override {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
  }
};

/// The system's clock as it was at the first call, going on without steps: when somebody sets the
/// clock, nothing is suddenly old. For what is measured within one process.
class MonotonicClock final : public Clock {
 public:
  [[nodiscard]] TimeNs now() const override {
    using Steady = std::chrono::steady_clock;
    static const TimeNs start = SystemClock().now();
    static const Steady::time_point begin = Steady::now();
    return start + std::chrono::nanoseconds(Steady::now() - begin).count();
  }
};

class FakeClock final : public Clock {
 public:
  explicit FakeClock(TimeNs start = 0) : now_(start) {}
  [[nodiscard]] TimeNs now() const override { return now_; }
  void advance(std::chrono::nanoseconds by) { now_ += by.count(); }

 private:
  TimeNs now_;
};

/// Steady milliseconds for measuring a stage.
class Stopwatch {
 public:
  [[nodiscard]] double ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace crane
