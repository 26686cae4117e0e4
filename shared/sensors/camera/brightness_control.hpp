// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "sensors/camera/frame_source.hpp"

namespace crane {

/// How bright a pair is, from every 16th pixel of every 8th row.
struct Brightness {
  double mean = 0;       ///< grey levels
  double saturated = 0;  ///< share of pixels of 250 and more
};
Brightness brightness_of(const FrameBuffers& pair, const FrameFacts& facts);

/// Keeps pictures neither black nor saturated, for matching: exposure first, up to what motion
/// allows, then gain. Both images are judged together and set alike, or they no longer match.
///
/// Within a fifth of the target nothing is touched: a setting that swings is worse than one that is
/// a little off. At most a factor of two at a time, and the next only once kSettle frames showed
/// it.
class BrightnessControl {
 public:
  struct Range {
    int least = 0, most = 0;  ///< as the camera counts
  };
  struct Setting {
    int exposure = 0, gain = 0;
    bool operator==(const Setting&) const = default;
  };
  /// `target` mean grey level. Exposure counts in time; gain in whatever: it is gone through in 32
  /// steps.
  BrightnessControl(double target, Range exposure, Range gain, Setting now)
      : target_(target), exposure_(exposure), gain_(gain), now_(now) {}

  /// What is to be set after this pair; nothing: all is well, or nothing more can be done.
  std::optional<Setting> after(const Brightness& seen);
  /// Brighter or darker was wanted and the limits forbid it.
  [[nodiscard]] bool at_limit() const { return at_limit_; }

  static constexpr int kSettle = 4;

 private:
  double target_;
  Range exposure_, gain_;
  Setting now_;
  int frames_ = 0;  ///< since the last change
  bool at_limit_ = false;
};

}  // namespace crane
