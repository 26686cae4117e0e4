// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "calibration/board.hpp"
#include "imaging/image.hpp"

namespace crane::test {

inline constexpr int kWidth = 1280, kHeight = 720;
inline constexpr double kF_px = 900;
inline constexpr double kPixelsPerMetre = 4000;  ///< of the drawn board
inline constexpr int kMargin = 60;               ///< [px] around it

/// The board flat, from above; its corner 0 is at (kMargin + offset) of the picture.
struct Drawn {
  cv::Mat picture;
  double corner_x = 0, corner_y = 0;
};

inline Drawn draw(const Board& board) {
  const auto px = [](double metres) {
    return static_cast<int>(std::lround(metres * kPixelsPerMetre));
  };
  const int square = px(board.square_m);
  const cv::Scalar white(255);
  if (board.kind == Board::Kind::kChessboard) {
    cv::Mat picture((board.rows + 1) * square + 2 * kMargin,
                    (board.columns + 1) * square + 2 * kMargin, CV_8UC1, white);
    for (int r = 0; r <= board.rows; ++r)
      for (int c = 0; c <= board.columns; ++c)
        if ((r + c) % 2 == 0)
          picture(cv::Rect(kMargin + c * square, kMargin + r * square, square, square)) = 20;
    return {picture, kMargin + square - 0.5, kMargin + square - 0.5};
  }
  if (board.kind == Board::Kind::kCharuco) {
    const auto layout = cv::aruco::CharucoBoard::create(
        board.columns + 1, board.rows + 1, float(board.square_m), float(board.marker_m),
        cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100));
    cv::Mat inside;
    layout->draw({(board.columns + 1) * square, (board.rows + 1) * square}, inside, 0, 1);
    cv::Mat picture;
    cv::copyMakeBorder(inside, picture, kMargin, kMargin, kMargin, kMargin, cv::BORDER_CONSTANT,
                       white);
    return {picture, kMargin + square - 0.5, kMargin + square - 0.5};
  }
  const int step = px(board.square_m + board.marker_m);
  cv::Mat picture(board.rows * step + 2 * kMargin, board.columns * step + 2 * kMargin, CV_8UC1,
                  white);
  // Kalibr's boards have black squares between the corners of the tags.
  const int gap = px(board.marker_m);
  for (int r = 0; r <= board.rows; ++r)
    for (int c = 0; c <= board.columns; ++c)
      picture(cv::Rect(kMargin + c * step - gap, kMargin + r * step - gap, gap, gap)) = 0;
  const auto tags = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  for (int r = 0; r < board.rows; ++r)
    for (int c = 0; c < board.columns; ++c) {
      cv::Mat tag;
      cv::aruco::drawMarker(tags, r * board.columns + c, square, tag, 2);  // as Kalibr prints them
      tag.copyTo(picture(cv::Rect(kMargin + c * step, kMargin + r * step, square, square)));
    }
  return {picture, kMargin - 0.5, kMargin - 0.5};
}

struct Rendered {
  Image image;
  std::vector<Eigen::Vector2d> corners;
};

/// A pinhole camera without distortion.
struct BoardCamera {
  int width = kWidth, height = kHeight;
  double f_px = kF_px, cx_px = 640.3, cy_px = 359.6;
};

inline Rendered render(const Board& board, const Eigen::Isometry3d& T,
                       const BoardCamera& camera = {}) {
  const Drawn drawn = draw(board);
  Eigen::Matrix3d K;
  K << camera.f_px, 0, camera.cx_px, 0, camera.f_px, camera.cy_px, 0, 0, 1;
  Eigen::Matrix3d board_to_image;
  board_to_image << T.linear().col(0), T.linear().col(1), T.translation();
  board_to_image = K * board_to_image;
  Eigen::Matrix3d picture_to_board = Eigen::Matrix3d::Identity();
  picture_to_board.topLeftCorner<2, 2>() *= 1 / kPixelsPerMetre;
  picture_to_board.topRightCorner<2, 1>() =
      Eigen::Vector2d(-drawn.corner_x, -drawn.corner_y) / kPixelsPerMetre;
  const Eigen::Matrix3d H = board_to_image * picture_to_board;
  cv::Matx33d warp;
  for (int i = 0; i < 9; ++i) warp(i / 3, i % 3) = H(i / 3, i % 3);
  // Twice as large first, then halved: the edges of a real image are not stairs.
  const cv::Matx33d twice(2, 0, 0.5, 0, 2, 0.5, 0, 0, 1);
  cv::Mat large, small;
  cv::warpPerspective(drawn.picture, large, twice * warp, {2 * camera.width, 2 * camera.height},
                      cv::INTER_AREA, cv::BORDER_CONSTANT, cv::Scalar(150));
  cv::resize(large, small, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(small, small, {0, 0}, 0.7);
  Rendered out;
  out.image = {std::uint32_t(camera.width), std::uint32_t(camera.height), 1, {}};
  out.image.bytes.assign(small.datastart, small.dataend);
  for (const auto& corner : board.corners()) {
    const Eigen::Vector3d p = board_to_image * Eigen::Vector3d(corner.x(), corner.y(), 1);
    out.corners.push_back(p.hnormalized());
  }
  return out;
}

/// The board's middle 0.55 m away, turned.
inline Rendered render(const Board& board, double tilt_rad, double turn_rad) {
  const Eigen::Vector3d middle = 0.5 * (board.corners().front() + board.corners().back());
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = (Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d(0.6, 0.8, 0)) *
                Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()))
                   .toRotationMatrix();
  T.translation() = Eigen::Vector3d(0.02, -0.01, 0.55) - T.linear() * middle;
  return render(board, T);
}

}  // namespace crane::test
