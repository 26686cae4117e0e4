// SPDX-License-Identifier: Apache-2.0
#include "base/loop_watch.hpp"

#include <pthread.h>

#include <utility>

namespace crane {

void LoopWatch::Mark::turned() const {
  state_->last.store(of_->now_(), std::memory_order_relaxed);
}

void LoopWatch::Mark::rests() const {
  state_->last.store(Clock::time_point::max(), std::memory_order_relaxed);
}

LoopWatch::Mark LoopWatch::watch(std::string name, std::chrono::milliseconds bound) {
  auto state = std::make_shared<State>();
  state->name = std::move(name);
  state->bound = bound;
  state->last = now_();
  const std::lock_guard lock(mutex_);
  std::erase_if(marks_, [](const auto& mark) { return mark.expired(); });
  marks_.push_back(state);
  return {std::move(state), this};
}

std::vector<LoopWatch::Stalled> LoopWatch::stalled() const {
  std::vector<Stalled> out;
  const std::lock_guard lock(mutex_);
  for (const auto& mark : marks_) {
    const auto state = mark.lock();
    if (!state) continue;
    const auto last = state->last.load(std::memory_order_relaxed);
    if (last == Clock::time_point::max()) continue;
    if (const auto silent = now_() - last; silent > state->bound)
      out.push_back({state->name, std::chrono::duration_cast<std::chrono::seconds>(silent)});
  }
  return out;
}

std::string LoopWatch::trouble() const {
  std::string text;
  for (const Stalled& s : stalled())
    text += (text.empty() ? "" : "; ") + s.name + " hangs: nothing done for " +
            std::to_string(s.silent.count()) + " s";
  return text;
}

LoopWatch& LoopWatch::of_process() {
  static auto* const kOne = new LoopWatch;
  return *kOne;
}

void name_thread(const char* name) {
  pthread_setname_np(pthread_self(), name);
}

}  // namespace crane
