#pragma once

#include <map>
#include <utility>
#include <vector>

#include "rtps_guard/fragments.hpp"
#include "rtps_guard/locators.hpp"
#include "rtps_guard/message.hpp"
#include "rtps_guard/numbers.hpp"

namespace crane::guard {

struct Writer {
  FragmentTrack fragments;
  std::uint32_t largest_sample = 0;  ///< of its topic; 0: its topic is not known
  bool announced = false;
};

/// Somebody who announced itself. Fast DDS listens to the writers of nobody else.
struct Participant {
  Clock::time_point heard;        ///< anything
  std::chrono::seconds lease{0};  ///< at most a minute
  std::vector<Ipv4> addresses;    ///< where it came from at first, and what it named then
  bool this_host = false;
  std::map<std::uint32_t, Writer> writers;
  /// By reader and writer, as Fast DDS has them; reader 0: for all of them.
  std::map<std::pair<std::uint32_t, std::uint32_t>, NumberTrack> numbers;

  [[nodiscard]] bool lives_at(const Origin& origin) const;
  [[nodiscard]] std::uint64_t held() const;
};

/// Who announced itself within the last minute (a lease is at most that long). Bounded: so many
/// newcomers at once, and so many a second after that, as each costs Fast DDS memory and time.
class Participants {
 public:
  static constexpr double kNewcomersAtOnce = 200, kNewcomersPerSecond = 10;
  static constexpr std::size_t kMost = 1024, kWritersOfOne = 256, kPairsOfOne = 1024;

  /// Null if not known, or not heard for longer than a lease.
  Participant* find(const Prefix& prefix, Clock::time_point now);
  /// Makes it known. Null: too many.
  Participant* announce(const Prefix& prefix, Clock::time_point now);
  void forget(const Prefix& prefix);
  std::map<Prefix, Participant>& all() { return all_; }
  /// Numbers that the forgotten held, since the last call.
  std::uint64_t take_released() { return std::exchange(released_, 0); }

 private:
  void release(const Participant& participant) { released_ += participant.held(); }

  std::map<Prefix, Participant> all_;
  std::uint64_t released_ = 0;
  double newcomers_ = kNewcomersAtOnce;
  Clock::time_point filled_{};
};

}  // namespace crane::guard
