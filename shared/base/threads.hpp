// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace crane {

/// Threads of one stage: more have not been tried.
inline constexpr int kMostThreads = 8;

/// `wanted`, or where that is 0 the machine's, at most 4.
inline int threads_or_default(int wanted) {
  const auto machine = static_cast<int>(std::thread::hardware_concurrency());
  return wanted > 0 ? std::min(wanted, kMostThreads) : std::clamp(machine, 1, 4);
}

/// Where the threads of one stage wait for each other, as often as they like. Unlike at a barrier
/// nobody waits for one that has failed.
class Meeting {
 public:
  struct Abandoned {};

  explicit Meeting(int members) : members_(members) {}

  /// Waits until all others have come as well. Throws Abandoned when one has failed.
  void meet() {
    std::unique_lock lock(mutex_);
    const unsigned round = round_;
    if (failed_) throw Abandoned();
    if (++waiting_ == members_) {
      waiting_ = 0;
      ++round_;
      changed_.notify_all();
      return;
    }
    changed_.wait(lock, [&] { return round_ != round || failed_; });
    if (round_ == round) throw Abandoned();
  }
  /// Does not wait: what the others may need is there, once and for all.
  void announce() {
    const std::lock_guard lock(mutex_);
    announced_ = true;
    changed_.notify_all();
  }
  /// Waits for the announcement. Throws Abandoned when a thread has failed before that.
  void await() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return announced_ || failed_; });
    if (!announced_) throw Abandoned();
  }
  void abandon() {
    const std::lock_guard lock(mutex_);
    failed_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  const int members_;
  unsigned round_ = 0;
  int waiting_ = 0;
  bool announced_ = false, failed_ = false;
};

/// Which part of `count` things is a thread's: [begin, end). All of them are somebody's.
struct Share {
  int begin, end;
};
constexpr Share share_of(int count, int thread, int threads) {
  const auto at = [&](int n) {
    return static_cast<int>(static_cast<long long>(count) * n / threads);
  };
  return {at(thread), at(thread + 1)};
}

/// Runs work(thread, meeting) for each thread from 0 on; 0 is this one. What any throws is thrown
/// here, once all have ended.
template <class Work>
void on_threads(int threads, Work work) {
  Meeting meeting(threads);
  std::vector<std::exception_ptr> failures(static_cast<std::size_t>(threads));
  const auto guarded = [&](int thread) {
    try {
      work(thread, meeting);
    } catch (const Meeting::Abandoned&) {  // another says why
    } catch (...) {
      failures[static_cast<std::size_t>(thread)] = std::current_exception();
      meeting.abandon();
    }
  };
  {
    std::vector<std::jthread> others;
    try {
      for (int thread = 1; thread < threads; ++thread) others.emplace_back(guarded, thread);
    } catch (...) {  // the machine has no thread left
      failures[0] = std::current_exception();
      meeting.abandon();
    }
    if (!failures[0]) guarded(0);
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

}  // namespace crane
