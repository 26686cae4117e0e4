// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// A flat calibration board. Its frame: origin at corner 0, x along a row of corners, y along a
/// column, z into the board where a camera sees x to the right and y down.
struct Board {
  enum class Kind {
    kChessboard,  ///< inner corners of a chessboard, all of them in each image
    kCharuco,     ///< chessboard with ArUco markers in its white squares; parts of it suffice
    kAprilGrid,   ///< Kalibr's grid of AprilTags 36h11; parts of it suffice
  };
  Kind kind = Kind::kChessboard;
  int columns = 0, rows = 0;  ///< inner corners (chessboard, ChArUco), tags (AprilGrid)
  double square_m = 0;        ///< side of a square, of a tag
  double marker_m = 0;        ///< ChArUco: side of a marker; AprilGrid: gap between tags
  std::string dictionary;     ///< ChArUco: OpenCV's name of the markers, "4X4_50"

  /// Of all corners by their id [m]; z = 0.
  [[nodiscard]] std::vector<Eigen::Vector3d> corners() const;
  /// Furthest distance between two corners [m].
  [[nodiscard]] double size_m() const;
  [[nodiscard]] std::string text() const;
};

/// "chessboard:9x6:0.025" (inner corners, square in metres), "charuco:11x8:0.03:0.022:5X5_100"
/// (inner corners, square, marker, dictionary), "aprilgrid:6x6:0.088:0.3" (tags, side of a tag, gap
/// as a part of that side, as Kalibr's tagSpacing). Error: Configuration.
Result<Board> parse_board(const std::string& text);

}  // namespace crane
