// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace crane {

/// Which loops of a process still turn. Each thread that has work for ever promises here to turn
/// within a bound; health is that all do. Any thread.
class LoopWatch {
  struct State;

 public:
  using Clock = std::chrono::steady_clock;

  /// One loop's promise; it ends with the object.
  class Mark {
   public:
    /// The loop turned. Cheap enough for every turn.
    void turned() const;
    /// Nothing to do until the next turned().
    void rests() const;

   private:
    friend class LoopWatch;
    Mark(std::shared_ptr<State> state, const LoopWatch* of) : state_(std::move(state)), of_(of) {}
    std::shared_ptr<State> state_;
    const LoopWatch* of_;  ///< outlives its marks
  };

  explicit LoopWatch(std::function<Clock::time_point()> now = &Clock::now) : now_(std::move(now)) {}

  /// `name`: for people, "heartbeat". From now on it must turn within `bound`, again and again.
  [[nodiscard]] Mark watch(std::string name, std::chrono::milliseconds bound);

  struct Stalled {
    std::string name;
    std::chrono::seconds silent{};
  };
  /// Those that did not turn within their bounds.
  [[nodiscard]] std::vector<Stalled> stalled() const;
  /// One line: "heartbeat hangs: nothing done for 12 s"; empty: all turn.
  [[nodiscard]] std::string trouble() const;

  /// Threads are the process's, whoever started them: there is one for all. Never destroyed.
  static LoopWatch& of_process();

 private:
  struct State {
    std::string name;
    std::chrono::milliseconds bound{};
    std::atomic<Clock::time_point> last{};
  };
  std::function<Clock::time_point()> now_;
  mutable std::mutex mutex_;
  mutable std::vector<std::weak_ptr<State>> marks_;  ///< the ended ones are left out when read
};

/// Names the calling thread, for ps, top and debuggers: at most 15 characters.
void name_thread(const char* name);

}  // namespace crane
