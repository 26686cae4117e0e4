// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "base/result.hpp"
#include "geometry/stereo_rig.hpp"

namespace crane {

/// How two raw images become one rectified pair: the same row of both shows the same points, and
/// both are those of a pinhole camera. OpenCV's own functions for each lens model; the view is cut
/// so that every pixel was seen.
struct Rectification {
  RectifiedCamera camera;
  /// For cv::remap, CV_16SC2 and CV_16UC1: where each pixel is in the raw image, to 1/32 px.
  cv::Mat left[2], right[2];
};

/// Error: Configuration for a rig that does not rectify.
Result<Rectification> rectification_of(const StereoRig& rig);

}  // namespace crane
