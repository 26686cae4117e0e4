// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "base/result.hpp"
#include "calibration/lens.hpp"
#include "calibration/view.hpp"

namespace crane {

/// What a rig is estimated to be, with how surely.
struct RigEstimate {
  LensNumbers left{}, right{};
  Eigen::Isometry3d T_right_left = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> T_left_board;  ///< of each view
  /// How far the middle of the board bulges from its corners' plane, by x and by y [m].
  Eigen::Vector2d warp_m = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< of one coordinate of a corner, from what the fit leaves

  /// Numbers of left lens, right lens, then T_right_left: rotation vector [rad], translation [m].
  static constexpr std::size_t kNumbers = 2 * kLensNumbers + 6;
  /// Of those numbers, from sigma_px; numbers that are not estimated have 0.
  Eigen::MatrixXd covariance;

  [[nodiscard]] double baseline_m() const { return T_right_left.translation().norm(); }
  [[nodiscard]] double baseline_sigma_m() const;
};

/// What the fit leaves of one corner: seen minus predicted [px].
struct Residual {
  std::size_t view = 0, corner = 0;  ///< which of the eye's corners
  bool right = false;
  Eigen::Vector2d seen, off;
};
std::vector<Residual> residuals(const std::vector<View>& views, const Board& board,
                                const RigEstimate& rig);

/// Where to begin: each camera alone by OpenCV's calibrateCamera (Zhang 2000), their relation from
/// the view that most others agree with. Error: BadData, where too few views show the board.
Result<RigEstimate> first_estimate(const std::vector<View>& views, const Board& board,
                                   const ImageSize& size);

/// All corners of both cameras at once, with the board's poses and its warp, by Ceres. `robust`:
/// corners that are far off count less (Cauchy); then there is no covariance. The warp needs eight
/// views; with fewer the board is taken for flat.
Result<RigEstimate> refine(const std::vector<View>& views, const Board& board,
                           const RigEstimate& from, LensFit model, bool robust);

}  // namespace crane
