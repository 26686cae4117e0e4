// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "base/wakeup.hpp"
#include "dds/endpoints.hpp"

namespace crane {

/// How fast a recording is played.
struct PlayRate {
  double factor = 1;  ///< times real time; 0 = as fast as the mapper takes frames
  [[nodiscard]] bool paced_by_map() const { return factor == 0; }
};

/// "real", "max" or a factor such as "2.5". Error: Configuration.
Result<PlayRate> parse_rate(const std::string& text);

/// Real-time play: when a recorded time is due. Players that share `wall_start` stay in step.
class PlayClock {
 public:
  PlayClock(PlayRate rate, TimeNs recorded_start, TimeNs wall_start)
      : rate_(rate), recorded_start_(recorded_start), wall_start_(wall_start) {}
  /// Wall time at which `recorded` is to be published.
  [[nodiscard]] TimeNs due(TimeNs recorded) const {
    return wall_start_ + static_cast<TimeNs>(double(recorded - recorded_start_) / rate_.factor);
  }

 private:
  PlayRate rate_;
  TimeNs recorded_start_, wall_start_;
};

/// Whose time stamps a play gives its samples.
enum class Stamps {
  kNow,       ///< as if it were measured now, where the players have a start in common
  kRecorded,  ///< the recording's own
};

/// What a play adds to every recorded time: one number for all players that were told the same
/// start, so that frames, positions and hoist keep their distances; after a restart as well. Times
/// never run ahead of the clock: a play that is faster than it ends now and began before.
/// `start_at`: when the first instant is played, wall clock; 0 = the players have none in common.
struct StampOffset {
  TimeNs ns = 0;
  const char* why_recorded = nullptr;  ///< why it is 0 although kNow was asked for
};
StampOffset stamp_offset(Stamps stamps, PlayRate rate, bool loop, TimeNs recorded_start,
                         TimeNs recorded_end, TimeNs start_at);

/// Play paced by the map: how far the mapper has got with one stream. It falls back when a mapper
/// is restarted from its last saved state; players then send again.
class MapProgress {
 public:
  static Result<MapProgress> create(const std::shared_ptr<dds::Participant>& participant,
                                    Wakeup* wakeup, std::uint64_t stream);
  /// Takes what arrived. Returns the last frame accounted for; -1 = none; nothing = no mapper
  /// heard.
  std::optional<std::int64_t> poll();

 private:
  MapProgress(dds::Reader<dds::MapStatusTopic> reader, std::uint64_t stream)
      : reader_(std::move(reader)), stream_(stream) {}
  dds::Reader<dds::MapStatusTopic> reader_;
  std::uint64_t stream_;
  std::optional<std::int64_t> last_;
};

}  // namespace crane
