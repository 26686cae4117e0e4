// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace crane {

/// Lets callbacks of any thread wake the one thread that owns a stage.
/// A notification that comes before the wait is not lost.
class Wakeup {
 public:
  void notify() {
    {
      const std::lock_guard lock(mutex_);
      pending_ = true;
    }
    condition_.notify_one();
  }

  /// True when notified, false on time-out.
  bool wait_for(std::chrono::milliseconds limit) {
    std::unique_lock lock(mutex_);
    const bool woken = condition_.wait_for(lock, limit, [this] { return pending_; });
    pending_ = false;
    return woken;
  }

 private:
  std::mutex mutex_;
  std::condition_variable condition_;
  bool pending_ = false;
};

}  // namespace crane
