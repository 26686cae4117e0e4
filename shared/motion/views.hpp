// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "motion/align.hpp"
#include "motion/key_frames.hpp"

namespace crane {

/// An earlier image as a stereo partner of the newest one.
struct MotionView {
  std::shared_ptr<const PlacedImage> image;
  Warp warp;                                                 ///< from the newest frame
  Eigen::Vector2d displacement_m = Eigen::Vector2d::Zero();  ///< of the newest from it, map x, y
  double sigma_m = 0;                                        ///< of the displacement along itself
  double noise_grey = 0;
};

struct ViewSet {
  std::vector<MotionView> views;  ///< none: nothing can be told by motion
  std::size_t misplaced = 0;      ///< earlier frames that do not lie where their positions say
  double noise_grey = 2;          ///< of a pixel
  double longest_m = 0;           ///< displacement
  /// Not all views lie on one straight way that was driven at one speed: what moves steadily by
  /// itself cannot fit all of them.
  bool proves_rest = false;
};

/// A few of the key frames, as different in baseline and direction as they are, with their places
/// refined by the images where these tell more than the rangefinders (3 mm are a pixel at 2 m).
/// On so many threads.
ViewSet choose_views(const DepthFrame& frame, const PlacedImage& image, const KeyFrames& keys,
                     std::size_t most, int threads = 1);

}  // namespace crane
