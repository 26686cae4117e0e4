// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <set>

#include "recording/image_file.hpp"
#include "recording/recording.hpp"
#include "sensors/camera/frame_source.hpp"
#include "service/player.hpp"

namespace crane {

/// A recording as a source: by the clock, when frames wait for nobody; or paced by the map, and
/// then what got lost on the way is sent again. No other source knows of that.
class RecordingSource final : public FrameSource {
 public:
  /// `progress`: of the map with this stream; used where the rate is paced by it, and woken by
  /// `wakeup`.
  RecordingSource(const PlayOptions& options, Recording recording, PlayRate rate,
                  std::optional<MapProgress> progress, std::unique_ptr<Wakeup> wakeup);

  /// Error: Configuration; Resource when the map does not answer.
  Result<Next> next(const FrameBuffers& out, FrameFacts& facts, Deadline deadline) override;
  /// Frames in all; 0: without end.
  [[nodiscard]] std::uint64_t expected() const {
    return options_.loop ? 0 : recording_.frames().size();
  }
  [[nodiscard]] const Recording& recording() const { return recording_; }
  [[nodiscard]] std::size_t image_bytes() const override { return image_bytes_; }

 private:
  Result<Next> next_by_clock(const FrameBuffers& out, FrameFacts& facts, Deadline deadline);
  Result<Next> next_for_map(const FrameBuffers& out, FrameFacts& facts);
  Result<bool> load(std::int64_t n, std::size_t pixels);
  bool fits(const FrameBuffers& out);
  [[nodiscard]] std::int64_t before(std::int64_t n) const;
  void fill(std::int64_t n, std::int64_t after, const FrameBuffers& out, FrameFacts& facts);

  PlayOptions options_;
  Recording recording_;
  PlayRate rate_;
  TimeNs stamp_offset_;
  std::optional<PlayClock> clock_;  ///< from the first call on
  std::optional<MapProgress> progress_;
  std::unique_ptr<Wakeup> wakeup_;
  std::size_t image_bytes_ = 0;
  std::int64_t next_ = 0, last_heard_ = -1, accounted_ = -1;
  int resends_ = 0;
  Stopwatch since_progress_;
  Image left_, right_;
  bool loaded_ = false;  ///< frame next_ is in left_ and right_
  double decode_ms_ = 0;
  std::set<std::int64_t> unreadable_;  ///< frames that will never be published
};

}  // namespace crane
