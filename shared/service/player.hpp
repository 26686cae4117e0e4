// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

#include "service/play_clock.hpp"
#include "service/run_service.hpp"

namespace crane {

/// A player paced by the map sends again what the map has not accounted for after this long, so
/// many times; then it gives up.
inline constexpr std::chrono::milliseconds kResendAfter{1500};
inline constexpr int kMaxResends = 20;

/// What the services that play a recording are told.
struct PlayOptions {
  std::string recording, rate = "real";
  bool loop = false;    ///< start over at the end
  bool resume = false;  ///< leave out what is already overdue at the start
  std::uint64_t stream = 0;
  TimeNs start_at = 0;  ///< wall time of the recording's first instant; 0 = now
  Stamps stamps = Stamps::kNow;
};

void add_play_options(CLI::App& app, PlayOptions& options);

/// The rate; a stream number is drawn where none was given. Error: Configuration.
Result<PlayRate> check_play_options(PlayOptions& options);

/// What is added to recorded times; said in the log where that is not what was asked for.
TimeNs stamp_offset(const PlayOptions& options, PlayRate rate, TimeNs recorded_start,
                    TimeNs recorded_end);

/// The clock of a timed play, shared by all players that were told the same start.
PlayClock play_clock(const PlayOptions& options, PlayRate rate, TimeNs recorded_start);

/// Sleeps until a wall time, with status messages; earlier when the service is to stop.
void wait_until(TimeNs due, ServiceContext& context);

/// Waits for a reader, and until it knows this writer as well.
template <class Writer>
void wait_for_reader(const Writer& writer, ServiceContext& context) {
  const TimeNs step = kNsPerSecond / 100;
  while (writer.matched() == 0 && !context.stopping())
    wait_until(MonotonicClock().now() + step, context);
  wait_until(MonotonicClock().now() + 30 * step, context);
}

/// Waits at the end until readers have all, at most 5 s and not beyond a stop.
template <class Writer>
void wait_until_taken(Writer& writer, ServiceContext& context) {
  constexpr std::chrono::milliseconds kStep{100};
  for (int n = 0; n < 50 && !context.stopping() && !writer.wait_for_readers(kStep); ++n)
    context.status.tick();
}

}  // namespace crane
