// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "base/clock.hpp"
#include "cloud/point_cloud.hpp"
#include "geometry/row_error.hpp"

namespace crane {

/// One organised cloud with memory of its own.
struct CloudSample {
  std::uint64_t stream = 0, sequence_number = 0;
  std::int64_t after = -1;  ///< frame that must have been accounted for; -1 = none
  TimeNs exposure_time = 0;
  TimeNs arrival_time = 0;
  TimeNs sent_time = 0;           ///< when the camera handed its frame on, wall clock
  std::uint64_t calibration = 0;  ///< digest of the calibration it was made with; 0 = not said
  DepthFrame frame;               ///< points into the vectors below once it is mapped
  Eigen::Matrix3d R_camera_rectified = Eigen::Matrix3d::Identity();
  RowError rows;  ///< of the stereo pair
  std::vector<float> depth_m;
  std::vector<std::uint8_t> confidence, colour;
  std::vector<float> ambiguous_m;  ///< empty, or one of several depths that fit a pixel; 0 = none
};

/// Which frames of a stream are in the map, and what became of the others.
struct FrameAccount {
  std::uint64_t stream = 0;
  std::int64_t last_frame = -1;  ///< sequence number accounted for; -1 = none
  TimeNs last_frame_time = 0;
  TimeNs last_frame_sent = 0;    ///< wall clock
  std::uint64_t integrated = 0;  ///< in the map
  std::uint64_t rejected = 0;    ///< arrived, but could not be used
  std::uint64_t missing = 0;     ///< never arrived
};

}  // namespace crane
