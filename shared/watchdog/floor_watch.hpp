// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <unordered_map>
#include <vector>

#include "watchdog/frame_view.hpp"

namespace crane {

/// A figure with its standard deviation; nothing known of it: an infinite one.
struct Figure {
  double value = 0;
  double sigma = std::numeric_limits<double>::infinity();
  [[nodiscard]] bool known() const { return sigma < std::numeric_limits<double>::infinity(); }
  /// By how many standard deviations it is off zero.
  [[nodiscard]] double sigmas() const { return known() ? std::abs(value) / sigma : 0; }
};

/// What the clouds say of the camera's height and tilt, over many frames and places.
///
/// A floor is nowhere exactly at 0 or level: what all places have in common is the height's error.
/// A slope of the floor stays where it is; one of the camera travels along, so that the same place
/// has another height when it is seen from further along. One thread; memory bounded.
class FloorWatch {
 public:
  /// `height_m`: of the camera above the floor, as told.
  explicit FloorWatch(double height_m) : height_m_(height_m) {}

  /// `view` of a frame that was placed. `sigma_m`: of one depth at the floor.
  void add(const FrameView& view, double sigma_m);

  struct Finding {
    std::size_t frames = 0, places = 0;
    Figure height_m;  ///< of the floor; the part of it that its unevenness does not explain
    /// Slopes of the camera [rad]: heights that it sees grow along x and y.
    Figure slope_x, slope_y;
    Figure seen_slope_x, seen_slope_y;  ///< in single frames: of the camera or of the floor
    /// How much the height's error grows from the middle of the image to as far aside as the
    /// camera is high [m]: a wrong angle between the cameras does that, a wrong height does not.
    Figure bend_m;
  };
  [[nodiscard]] const Finding& finding() const { return finding_; }
  void clear();

 private:
  struct Place {
    float z_m = 0, weight = 0;
  };
  /// The floor's height in places, or nothing when no height is that of many.
  [[nodiscard]] std::optional<double> floor_of(std::vector<float>& heights) const;
  void add_places(const FrameView& view);
  void fit_frame(const FrameView& view);
  void compare(const FrameView& view, const FrameView& before);

  double height_m_;
  double sigma_m_ = 0;
  std::unordered_map<std::uint64_t, Place> places_;
  std::size_t view_places_ = 0;  ///< in the first view
  std::deque<FrameView> before_;
  /// Normal equations of heights seen again against how far the camera went in between.
  Eigen::Matrix2d again_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d again_rhs_ = Eigen::Vector2d::Zero();
  double again_sum_ = 0, again_count_ = 0;
  Eigen::Vector3d shape_ = Eigen::Vector3d::Zero(), shape_squares_ = Eigen::Vector3d::Zero();
  double shape_count_ = 0;
  Finding finding_;
};

}  // namespace crane
