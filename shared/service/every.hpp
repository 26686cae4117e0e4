// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace crane {

/// True once per period; never at 0 Hz.
class Every {
 public:
  explicit Every(double hz) : period_(1.0 / hz) {}
  bool due() {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < period_) return false;
    last_ = now;
    return true;
  }

 private:
  std::chrono::duration<double> period_;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace crane
