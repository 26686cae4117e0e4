// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "motion/placed_image.hpp"

namespace crane {

/// How far the camera went by what its images show: each frame against a key frame (motion/align),
/// which stays while both see enough of the same. One thread; memory: two images.
class ImageMotion {
 public:
  /// `height_m`: of the camera above the floor.
  explicit ImageMotion(double height_m) : height_m_(height_m) {}

  struct Seen {
    Eigen::Vector2d off_m;  ///< how much farther (map) the camera went than positions say
    double sigma_m = 0;     ///< of each, without what wrong depths make of it
  };
  /// `frame` is placed. Nothing when there is no key yet, or what both see does not tell: no
  /// colour, no texture, no overlap, one pattern all over. `expected_off_m`: where it is looked for
  /// first; where nothing fits there, in a seventh of the camera's height around.
  std::optional<Seen> measure(const DepthFrame& frame, TimeNs exposure,
                              const Eigen::Vector2d& expected_off_m);
  /// The frame measured last is what the next ones are compared with. False: it had no colour.
  bool make_key();
  /// Share of the floor that the key and the frame measured last both see.
  [[nodiscard]] double overlap() const { return overlap_; }
  [[nodiscard]] bool has_key() const { return key_.has_value(); }
  /// Frames in a row that fitted nowhere.
  [[nodiscard]] int lost() const { return lost_; }
  void clear() { key_.reset(), lost_ = 0; }

 private:
  double height_m_;
  std::optional<PlacedImage> key_, last_;
  double overlap_ = 0;
  int lost_ = 0;
};

}  // namespace crane
