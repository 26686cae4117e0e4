// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <string>

#include "recording/image_file.hpp"
#include "recording/recording.hpp"

namespace crane {

/// Writes a recording that Recording::open() reads. Errors come from the first failing call.
class RecordingWriter {
 public:
  /// Makes the folders and the calibration files. Error: Resource; Configuration for a folder that
  /// is not empty.
  static Result<RecordingWriter> create(const std::string& folder, const StereoRig& rig,
                                        double rate_hz, const RangefinderModel& rangefinder);

  /// `extension`: "png" or "jpg".
  Result<void> add_frame(TimeNs time, const Image& left, const Image& right,
                         const std::string& extension);
  Result<void> add_cart(TimeNs time, double distance_m);
  /// The first one makes cart1.
  Result<void> add_cart_second(TimeNs time, double distance_m);
  Result<void> add_trolley(TimeNs time, double distance_m);
  /// The first one makes hoist0.
  Result<void> add_hoist(const HoistReading& reading);
  /// Flushes; a full disk is an error here at the latest.
  Result<void> close();

 private:
  std::string folder_;
  std::ofstream cam_[2], cart_, cart_second_, trolley_, hoist_;
};

}  // namespace crane
