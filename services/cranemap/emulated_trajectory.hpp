// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "recording/recording.hpp"
#include "sim/scene.hpp"

namespace crane {

/// So long before its first image a recording that is rendered from a scene begins with its
/// rangefinders: an emulated scene begins then as well, so that camera and rangefinders keep step.
inline constexpr TimeNs kBeforeFirstImage = 3 * kNsPerSecond / 10;

/// Where an emulated rangefinder's axis is, as a distance over time.
class EmulatedTrajectory {
 public:
  struct ToAndFro {
    double from_m = 2, to_m = 20, speed_mps = 0.5;
  };
  explicit EmulatedTrajectory(const ToAndFro& o) : to_and_fro_(o) {}
  /// What a recording's rangefinder read, round and round. Error: BadData.
  static Result<EmulatedTrajectory> of_recording(const std::string& folder, bool cart);
  /// Of a scene, with its rangefinder's noise and delay.
  static EmulatedTrajectory of_scene(Scene scene, bool cart);

  /// At so many seconds after the start [m].
  [[nodiscard]] double at(double seconds) const;

 private:
  ToAndFro to_and_fro_;
  std::vector<RecordedDistance> recorded_;
  TimeNs start_ = 0, period_ = 1;
  std::optional<Scene> scene_;
  bool cart_ = true;
};

}  // namespace crane
