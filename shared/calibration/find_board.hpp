// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "calibration/board.hpp"
#include "recording/image_file.hpp"

namespace crane {

/// Corners of a board as one image shows them.
struct Corners {
  std::vector<int> ids;                 ///< into Board::corners(), rising
  std::vector<Eigen::Vector2d> pixels;  ///< (x, y); the middle of the first pixel is (0, 0)

  [[nodiscard]] bool empty() const { return ids.empty(); }
};

/// Finds one kind of board in images.
class BoardFinder {
 public:
  /// Error: Configuration for a dictionary that OpenCV does not have, or that is too small.
  static Result<BoardFinder> of(const Board& board);

  /// Empty: no board, or too little of it to be of use.
  [[nodiscard]] Corners find(const Image& image) const;

  /// A chessboard of other numbers of corners that `image` shows, when `board` is not in it; empty
  /// text: none.
  [[nodiscard]] std::string other_board(const Image& image) const;

 private:
  explicit BoardFinder(Board board, int dictionary)
      : board_(std::move(board)), dictionary_(dictionary) {}

  Board board_;
  int dictionary_;  ///< OpenCV's number
};

}  // namespace crane
