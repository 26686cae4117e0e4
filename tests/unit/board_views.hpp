// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <vector>

#include "calibration/bundle.hpp"
#include "calibration/view.hpp"

namespace crane::test {

/// Two cameras, 0.12 m apart and turned a little, whose numbers are known.
inline RigEstimate true_rig() {
  RigEstimate rig;
  rig.left = {700, 702, 642, 358, -0.17, 0.03, 0.0005, -0.0004};
  rig.right = {704, 705, 636, 363, -0.16, 0.025, -0.0003, 0.0002};
  rig.T_right_left.linear() = (Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(-0.006, Eigen::Vector3d::UnitX()) *
                               Eigen::AngleAxisd(0.004, Eigen::Vector3d::UnitZ()))
                                  .toRotationMatrix();
  rig.T_right_left.translation() = Eigen::Vector3d(-0.1198, 0.0007, -0.0004);
  return rig;
}

inline constexpr ImageSize kBoardImages{1280, 720};

/// The board at `count` places all over the image, tilted up to `tilt_rad`; in the left camera.
inline std::vector<Eigen::Isometry3d> board_places(const Board& board, int count, double tilt_rad) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> one(-1, 1);
  const Eigen::Vector3d middle = 0.5 * (board.corners().front() + board.corners().back());
  std::vector<Eigen::Isometry3d> out;
  for (int i = 0; i < count; ++i) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = (Eigen::AngleAxisd(tilt_rad * one(random), Eigen::Vector3d::UnitX()) *
                  Eigen::AngleAxisd(tilt_rad * one(random), Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(0.3 * one(random), Eigen::Vector3d::UnitZ()))
                     .toRotationMatrix();
    const double away = 0.25 + 0.3 * (one(random) + 1);
    const Eigen::Vector3d at(0.06 + away * 0.85 * one(random), away * 0.46 * one(random), away);
    T.translation() = at - T.linear() * middle;
    out.push_back(T);
  }
  return out;
}

/// Corners that one camera sees of the board at T_camera_board, with noise; whole or not at all.
inline Corners seen_corners(const Board& board, const LensNumbers& lens,
                            const Eigen::Isometry3d& T_camera_board, double noise_px,
                            std::mt19937& random) {
  std::normal_distribution<double> noise(0, noise_px);
  Corners out;
  int id = 0;
  for (const auto& corner : board.corners()) {
    const Eigen::Vector3d p = T_camera_board * corner;
    Eigen::Vector2d pixel;
    project(lens.data(), p.data(), pixel.data());
    if (pixel.x() < 4 || pixel.y() < 4 || pixel.x() > kBoardImages.width - 5 ||
        pixel.y() > kBoardImages.height - 5)
      return {};
    out.ids.push_back(id++);
    out.pixels.push_back(pixel + Eigen::Vector2d(noise(random), noise(random)));
  }
  return out;
}

inline std::vector<View> board_views(const Board& board, const RigEstimate& rig,
                                     const std::vector<Eigen::Isometry3d>& places,
                                     double noise_px) {
  std::mt19937 random(3);
  std::vector<View> out;
  for (std::size_t i = 0; i < places.size(); ++i) {
    View view{"view" + std::to_string(i),
              seen_corners(board, rig.left, places[i], noise_px, random),
              seen_corners(board, rig.right, rig.T_right_left * places[i], noise_px, random)};
    if (!view.left.empty() || !view.right.empty()) out.push_back(std::move(view));
  }
  return out;
}

}  // namespace crane::test
