// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/clock.hpp"

namespace crane {

/// When a voxel was last measured, in a byte: a number of epochs since the start of the map, modulo
/// 255, plus one; 0 = never. A hundred epochs are the time after which it is forgotten.
using Epoch = std::uint8_t;

inline constexpr std::uint64_t kEpochsToForget = 100;

constexpr Epoch epoch_of(std::uint64_t epochs) {
  return static_cast<Epoch>(1 + epochs % 255);
}

/// Age in epochs at `now`. Ages of up to 254 are told apart: nothing may stay that long.
constexpr Epoch age(Epoch seen, Epoch now) {
  return static_cast<Epoch>(now - seen - (now < seen ? 1 : 0));
}

/// Time as the ages of the map count it. It follows the exposures, and the system's clock while
/// there are none; it never runs back, whatever recording is played next.
class AgeClock {
 public:
  void at_exposure(TimeNs exposure, TimeNs now) {
    constexpr TimeNs kOtherRecording = 60 * kNsPerSecond;
    if (time_ == 0 || exposure + offset_ < time_ - kOtherRecording) offset_ = time_ - exposure;
    time_ = std::max(time_, exposure + offset_);
    counted_from_ = time_;
    exposure_seen_at_ = now;
  }
  /// A camera that is silent does not stop time.
  void at_rest(TimeNs now) {
    if (exposure_seen_at_ != 0) time_ = std::max(time_, counted_from_ + (now - exposure_seen_at_));
  }
  [[nodiscard]] TimeNs time() const { return time_; }
  /// Of an exposure of the recording that is playing.
  [[nodiscard]] TimeNs of_exposure(TimeNs exposure) const { return exposure + offset_; }
  /// Of a map that was kept: its age when it was saved, at the exposure that was then the last.
  void restore(TimeNs time, TimeNs last_exposure) {
    time_ = time;
    offset_ = time - last_exposure;
  }

 private:
  TimeNs time_ = 0, offset_ = 0, counted_from_ = 0, exposure_seen_at_ = 0;
};

}  // namespace crane
