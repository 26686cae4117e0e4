// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "watchdog/floor_watch.hpp"

namespace crane {

/// A frame's place by the rangefinders, and how much farther its images say the camera went.
struct MotionSample {
  double time_s = 0;
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d speed_mps = Eigen::Vector2d::Zero();  ///< by the rangefinders
  Eigen::Vector2d off_m = Eigen::Vector2d::Zero();
  double sigma_m = 0;
};

/// What images and rangefinders disagree on, of one axis.
struct AxisFit {
  Figure scale;       ///< the camera goes farther than the axis's readings by this share
  Figure turn;        ///< and along this axis, by this share of the way along the other one [rad]
  Figure delay_s;     ///< readings are stamped so much later than they were true
  double rest_m = 0;  ///< standard deviation of what that leaves
};

/// off = a + scale * way + turn * way of the other axis + delay * speed, by least squares, with
/// weak limits on each so that what the motion does not tell stays unknown. Errors of samples hang
/// together (a swaying camera): their correlation makes the figures' standard deviations larger.
AxisFit fit_axis(const std::vector<MotionSample>& samples, int axis);

/// A step between two samples that explains them better than fit_axis() does.
struct Step {
  std::size_t before = 0;  ///< index of the first sample after it
  double size_m = 0;       ///< readings are so much farther from then on
  double rest_m = 0;
};
/// The best one that at least two samples follow and one precedes.
std::optional<Step> best_step(const std::vector<MotionSample>& samples, int axis);

}  // namespace crane
