// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "geometry/hoist_reading.hpp"
#include "geometry/stereo_rig.hpp"
#include "recording/calibration.hpp"

namespace crane {

struct RecordedFrame {
  TimeNs time = 0;
  std::string left_file, right_file;  ///< full paths
};

struct RecordedDistance {
  TimeNs time = 0;
  double distance_m = 0;  ///< NaN where the device wrote none
};

/// A recording in ASL/EuRoC layout: cam0 cam1 cart0 [cart1] trolley0 [hoist0] rig.yaml [site.yaml]
/// [truth]. Images stay on disk.
class Recording {
 public:
  /// Reads and checks everything but the pixels: calibration, equal left and right counts, pairs
  /// within 5 ms, increasing times of one clock. Error: Configuration or BadData; files and lines
  /// are named.
  static Result<Recording> open(const std::string& folder);

  [[nodiscard]] const std::string& folder() const { return folder_; }
  [[nodiscard]] const StereoRig& rig() const { return rig_; }
  [[nodiscard]] const std::vector<RecordedFrame>& frames() const { return frames_; }
  [[nodiscard]] const std::vector<RecordedDistance>& cart() const { return cart_; }
  /// cart1: the cart at the other rail; empty where there is none.
  [[nodiscard]] const std::vector<RecordedDistance>& cart_second() const { return cart_second_; }
  [[nodiscard]] const std::vector<RecordedDistance>& trolley() const { return trolley_; }
  /// hoist0: what the controller said of hook and load; empty where there is none.
  [[nodiscard]] const std::vector<HoistReading>& hoist() const { return hoist_; }
  [[nodiscard]] const RangefinderModel& cart_model() const { return cart_model_; }
  [[nodiscard]] const RangefinderModel& trolley_model() const { return trolley_model_; }
  /// Earliest time of any sensor.
  [[nodiscard]] TimeNs start() const;
  /// Latest time of camera and rangefinders.
  [[nodiscard]] TimeNs end() const;
  /// By how much times grow from one round of a looped play to the next.
  [[nodiscard]] TimeNs loop_period() const;
  /// Frame n of a play that starts over at the end; its time grows from round to round.
  [[nodiscard]] const RecordedFrame& frame(std::int64_t n) const {
    return frames_[static_cast<std::size_t>(n) % frames_.size()];
  }
  [[nodiscard]] TimeNs frame_time(std::int64_t n) const {
    return frame(n).time + n / static_cast<std::int64_t>(frames_.size()) * loop_period();
  }

 private:
  std::string folder_;
  StereoRig rig_;
  std::vector<RecordedFrame> frames_;
  std::vector<RecordedDistance> cart_, cart_second_, trolley_;
  std::vector<HoistReading> hoist_;
  RangefinderModel cart_model_, trolley_model_;
};

}  // namespace crane
