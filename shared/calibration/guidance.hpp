// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/coverage.hpp"

namespace crane {

/// What the next view of the board should show.
struct NextView {
  bool right = false;       ///< which image it is told in
  double x = 0.5, y = 0.5;  ///< middle of the board, shares of the image's width and height
  double width = 0.45;      ///< of the board, share of the image's width
  double tilt_x_rad = 0;    ///< > 0: its lower edge is turned towards the camera
  double tilt_y_rad = 0;    ///< > 0: its right edge is
  std::string words;        ///< the same for the person who holds the board
};

/// The view that a calibration gains most by: where the fewest corners were seen, tilted the way
/// that was tilted least. Nothing: no more is missing.
std::optional<NextView> next_view(const Coverage& coverage);

/// The board's outline in that image, as the next view should show it [px]: upper left, upper
/// right, lower right, lower left.
std::array<Eigen::Vector2d, 4> outline(const NextView& next, const Board& board,
                                       const ImageSize& size);

/// Coverage before there is a calibration: tilts by a camera whose focal length is guessed, which
/// is good enough to say which way to tilt.
Coverage rough_coverage(const std::vector<View>& views, const Board& board, const ImageSize& size);

/// Decides of each view, while a camera runs, whether it is worth keeping.
class ViewGate {
 public:
  ViewGate(Board board, ImageSize size) : board_(std::move(board)), size_(size) {}

  /// Why a view is not kept; empty: it is, and counts from now on. Asked with each pair as it
  /// comes, so that a board that moves is seen to.
  std::string refuse(const View& view);
  [[nodiscard]] const std::vector<View>& kept() const { return kept_; }

 private:
  Board board_;
  ImageSize size_;
  View before_;
  std::vector<View> kept_;
};

}  // namespace crane
