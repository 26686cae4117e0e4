// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "rtps_guard/allowance.hpp"
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
  static constexpr std::size_t kEndpoints = 256, kPairs = 256;
  static constexpr double kEndpointsPerSecond = 2;
  /// Heard for so long without its lease ending: not one of a flood of newcomers.
  static constexpr std::chrono::seconds kSettledAfter{30};

  Clock::time_point since;        ///< admitted
  Clock::time_point heard;        ///< anything
  std::chrono::seconds lease{0};  ///< at most a minute
  bool lapsed = false;            ///< not heard for its lease: Fast DDS makes it anew
  bool settled = false;           ///< when it lapsed
  std::vector<Ipv4> addresses;    ///< where it came from at first, and what it named then
  bool this_host = false;
  std::map<std::uint32_t, Writer> writers;
  std::set<std::uint32_t> readers;  ///< that it announced
  /// Endpoints that it announces, again or for the first time.
  Allowance endpoints{kEndpoints, kEndpointsPerSecond};
  /// By reader and writer, as Fast DDS has them; reader 0: for all of them.
  std::map<std::pair<std::uint32_t, std::uint32_t>, NumberTrack> numbers;

  [[nodiscard]] bool lives_at(const Origin& origin) const;
  [[nodiscard]] std::uint64_t held() const;
  [[nodiscard]] bool has_announced(std::uint32_t entity) const;
  void forget_endpoint(std::uint32_t entity);
  void forget_endpoints();
  /// Its lease has ended, or it is said to have: until it announces itself again.
  void lapse();
};

/// Who may still become known: each costs Fast DDS memory and time. Who floods from another host
/// keeps out nobody of this one, and of the others not those at another address.
class Newcomers {
 public:
  static constexpr double kAtOnce = 200, kPerSecond = 10;
  static constexpr double kOfOneAddressAtOnce = 100, kOfOneAddressPerSecond = 5;
  static constexpr std::size_t kAddresses = 256;

  bool admit(const Origin& origin, Clock::time_point now);

 private:
  Allowance this_host_{kAtOnce, kPerSecond}, elsewhere_{kAtOnce, kPerSecond};
  std::map<Ipv4, Allowance> addresses_;
};

/// Who announced itself within the last minute (a lease is at most that long). Bounded.
class Participants {
 public:
  static constexpr std::size_t kMost = 2048;
  /// Endpoints of all: with some hundreds of peers Fast DDS takes milliseconds for each, and sends
  /// a reader that comes all that a writer keeps.
  static constexpr double kEndpointsAtOnce = 1024, kEndpointsPerSecond = 32;

  /// Null if not known, or not heard for longer than a lease.
  Participant* find(const Prefix& prefix, Clock::time_point now);
  /// Makes it known, or known anew. Null: too many.
  Participant* announce(const Prefix& prefix, const Origin& origin, Clock::time_point now);
  /// What it says of an endpoint, one that is known already or not. False: too many, or too many
  /// at once.
  bool admit_endpoint(Participant& of, bool known, Clock::time_point now);
  std::map<Prefix, Participant>& all() { return all_; }
  /// Numbers that the forgotten held, since the last call.
  std::uint64_t take_released() { return std::exchange(released_, 0); }

 private:
  void release(const Participant& participant) { released_ += participant.held(); }

  std::map<Prefix, Participant> all_;
  std::uint64_t released_ = 0;
  Newcomers newcomers_;
  /// Of those who were settled: a flood on a busy host, which lets leases end, does not keep out
  /// who was there before it.
  Newcomers returning_;
  Allowance endpoints_{kEndpointsAtOnce, kEndpointsPerSecond};
  Allowance returning_endpoints_{kEndpointsAtOnce, kEndpointsPerSecond};
};

}  // namespace crane::guard
