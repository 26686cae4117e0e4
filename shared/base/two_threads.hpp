// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

namespace crane {

/// Where two threads wait for each other, as often as they like. Unlike at a barrier nobody waits
/// for one that has failed.
class Meeting {
 public:
  struct Abandoned {};

  /// Waits until the other has come as well. Throws Abandoned when it has failed.
  void meet() {
    std::unique_lock lock(mutex_);
    const unsigned round = round_;
    if (failed_) throw Abandoned();
    if (waiting_) {
      waiting_ = false;
      ++round_;
      changed_.notify_one();
      return;
    }
    waiting_ = true;
    changed_.wait(lock, [&] { return round_ != round || failed_; });
    if (round_ == round) throw Abandoned();
  }
  /// Does not wait: what the other may need is there, once and for all.
  void announce() {
    const std::lock_guard lock(mutex_);
    announced_ = true;
    changed_.notify_one();
  }
  /// Waits for the other's announcement. Throws Abandoned when it has failed before that.
  void await() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return announced_ || failed_; });
    if (!announced_) throw Abandoned();
  }
  void abandon() {
    const std::lock_guard lock(mutex_);
    failed_ = true;
    changed_.notify_one();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  unsigned round_ = 0;
  bool waiting_ = false, announced_ = false, failed_ = false;
};

/// Runs `here` on this thread and `there` on another; each gets the Meeting. What either throws is
/// thrown here, once both have ended.
template <class Here, class There>
void on_two_threads(Here here, There there) {
  Meeting meeting;
  std::exception_ptr mine, theirs;
  const auto guarded = [&meeting](auto& work, std::exception_ptr& failure) {
    try {
      work(meeting);
    } catch (const Meeting::Abandoned&) {  // the other says why
    } catch (...) {
      failure = std::current_exception();
      meeting.abandon();
    }
  };
  {
    const std::jthread other([&] { guarded(there, theirs); });
    guarded(here, mine);
  }
  if (mine) std::rethrow_exception(mine);
  if (theirs) std::rethrow_exception(theirs);
}

}  // namespace crane
