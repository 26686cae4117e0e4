// SPDX-License-Identifier: Apache-2.0
#include "service/play_clock.hpp"

#include <charconv>

namespace crane {

Result<PlayRate> parse_rate(const std::string& text) {
  if (text == "real") return PlayRate{1};
  if (text == "max") return PlayRate{0};
  PlayRate rate;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), rate.factor);
  if (failed == std::errc() && end == text.data() + text.size() && rate.factor >= 0.01 &&
      rate.factor <= 100)
    return rate;
  return Error{ErrorCode::kConfiguration, "--rate", "'" + text + "' is no rate",
               "give real, max, or a factor 0.01 .. 100"};
}

StampOffset stamp_offset(Stamps stamps, PlayRate rate, bool loop, TimeNs recorded_start,
                         TimeNs recorded_end, TimeNs start_at) {
  if (stamps == Stamps::kRecorded) return {};
  if (start_at <= 0) return {0, "the players were not told the same --start-at"};
  if (rate.paced_by_map()) return {start_at - recorded_end};
  const TimeNs aligned = start_at - recorded_start;
  if (rate.factor <= 1) return {aligned};
  if (loop) return {0, "played round and round and faster than real they run ahead of the clock"};
  const auto length = double(recorded_end - recorded_start);
  return {aligned - static_cast<TimeNs>(length - length / rate.factor)};
}

Result<MapProgress> MapProgress::create(const std::shared_ptr<dds::Participant>& participant,
                                        Wakeup* wakeup, std::uint64_t stream) {
  auto reader = dds::Reader<dds::MapStatusTopic>::create(participant, wakeup);
  if (!reader) return reader.error();
  return MapProgress(std::move(*reader), stream);
}

std::optional<std::int64_t> MapProgress::poll() {
  while (auto status = reader_.take()) {
    const v1::MapStatus& s = **status;
    if (s.crane() == 0) continue;
    last_ = s.stream() == stream_ && s.last_frame_time_ns() > 0
                ? static_cast<std::int64_t>(s.last_frame())
                : -1;
  }
  return last_;
}

}  // namespace crane
