// SPDX-License-Identifier: Apache-2.0
#include "service/player.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <random>
#include <thread>

#include "base/log.hpp"

namespace crane {

void add_play_options(CLI::App& app, PlayOptions& options) {
  app.add_option("RECORDING", options.recording, "Folder in ASL/EuRoC layout")->required();
  app.add_option("--rate", options.rate,
                 "real, a factor of it, or max: as fast as the mapper takes frames")
      ->capture_default_str();
  app.add_flag("--loop", options.loop, "Start over at the end (not with --rate max)");
  app.add_option("--stream", options.stream,
                 "Number of this stream, the same for all players of a run; 0 = a random one");
  app.add_option("--start-at", options.start_at,
                 "Wall time [ns] of the recording's first instant; 0 = now");
  app.add_option("--stamps", options.stamps,
                 "Times of the samples: now, which needs --start-at, the same for all players of a "
                 "run, or recorded")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Stamps>{{"now", Stamps::kNow}, {"recorded", Stamps::kRecorded}}))
      ->default_str("now");
  app.add_flag("--resume", options.resume, "Leave out what is already overdue at the start");
}

Result<PlayRate> check_play_options(PlayOptions& options) {
  auto rate = parse_rate(options.rate);
  if (!rate) return rate;
  if (rate->paced_by_map() && options.loop)
    return Error{ErrorCode::kConfiguration, "--loop", "does not go with --rate max", ""};
  if (options.stream == 0) options.stream = std::random_device{}() | 1U;
  return rate;
}

TimeNs stamp_offset(const PlayOptions& options, PlayRate rate, TimeNs recorded_start,
                    TimeNs recorded_end) {
  const StampOffset offset = stamp_offset(options.stamps, rate, options.loop, recorded_start,
                                          recorded_end, options.start_at);
  if (offset.why_recorded != nullptr)
    log_info(std::string("time stamps are the recording's own: ") + offset.why_recorded);
  return offset.ns;
}

PlayClock play_clock(const PlayOptions& options, PlayRate rate, TimeNs recorded_start) {
  const TimeNs soon = MonotonicClock().now() + kNsPerSecond / 5;
  return {rate, recorded_start, options.start_at > 0 ? options.start_at : soon};
}

void wait_until(TimeNs due, ServiceContext& context) {
  const MonotonicClock wall;
  for (TimeNs now = wall.now(); now < due && !context.stopping(); now = wall.now()) {
    context.status.tick();
    std::this_thread::sleep_for(std::chrono::nanoseconds(std::min<TimeNs>(due - now, 50'000'000)));
  }
}

}  // namespace crane
