// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/stereo_rig.hpp"
#include "recording/recording.hpp"

namespace crane {

/// One point of the world as one frame's rectified pair shows it.
struct Sighting {
  std::size_t track = 0;  ///< which point: the same number in all frames
  double u_px = 0, v_px = 0;
  double right_u_px = 0;  ///< in the same row of the right image
};

/// What one exposure shows.
struct DriveFrame {
  TimeNs time = 0;
  std::vector<Sighting> sightings;
};

/// What a recording of a drive says, before anything is made of it.
struct Drive {
  StereoRig rig;           ///< as told
  RectifiedCamera camera;  ///< what sightings belong to
  std::vector<DriveFrame> frames;
  std::size_t tracks = 0;
  std::vector<RecordedDistance> cart, cart_second, trolley;
  std::vector<HoistReading> hoist;
  double told_height_m = 0;
  std::size_t recorded_frames = 0;  ///< of which `frames` are some
};

/// Follows points of the floor through the images: corners by OpenCV (Shi and Tomasi 1994), to the
/// right image and on to the next frame by pyramids of Lucas and Kanade, each there and back. What
/// does not come back to where it began, or lies off its row, is dropped. At most 400 frames are
/// looked at, spread evenly. `rig`: the recording's own, or another calibration. `progress`: false
/// stops. Error: BadData for an image that cannot be read, Configuration for a calibration that
/// does not rectify, NotAvailable when stopped.
Result<Drive> read_drive(const Recording& recording, const StereoRig& rig,
                         const std::function<bool(std::size_t done, std::size_t total)>& progress);

}  // namespace crane
