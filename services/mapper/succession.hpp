// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "base/wakeup.hpp"
#include "dds/endpoints.hpp"

namespace crane {

/// Which mapper of a crane is right: the one of the highest term. One thread.
class Succession {
 public:
  /// `mapper`: our own number.
  static Result<Succession> create(const std::shared_ptr<dds::Participant>& participant,
                                   Wakeup* wakeup, std::uint64_t mapper);

  /// Listens for a mapper that serves the crane, for 0.7 s: its heartbeat comes within 0.2 s once
  /// both know each other.
  bool another_serves(const std::function<bool()>& stopping);
  /// Whether a mapper of a higher term than ours serves, so that nobody hears us any more.
  struct Rival {
    int term = 0;  ///< 0 = there is none
    /// It began moments ago, because it did not hear us, with nothing or hardly anything.
    bool began_anew = false;
  };
  /// `tiles`: of our map.
  Rival look(int term, std::size_t tiles);
  /// Error: Resource: that mapper has taken over.
  [[nodiscard]] Error deposed_by(const Rival& rival, int term) const;

  /// Terms follow the clock, so that a mapper that starts alone is stronger than what subscribers
  /// may still believe to serve: seconds since 2020, or one more than the one that was heard.
  static int next_term(int heard);

 private:
  Succession(dds::Reader<dds::MapStatusTopic> others, Wakeup* wakeup, std::uint64_t mapper,
             std::uint32_t crane)
      : others_(std::move(others)), wakeup_(wakeup), mapper_(mapper), crane_(crane) {}

  dds::Reader<dds::MapStatusTopic> others_;
  Wakeup* wakeup_;
  std::uint64_t mapper_;
  std::uint32_t crane_;
};

}  // namespace crane
