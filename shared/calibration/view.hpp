// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "calibration/board.hpp"
#include "calibration/find_board.hpp"

namespace crane {

/// One position of the board: what the two cameras saw of it at the same time. One of both may be
/// empty: close-ups of one camera are of use too.
struct View {
  std::string name;  ///< of the image pair
  Corners left, right;
};

/// Size of both cameras' images [px].
struct ImageSize {
  std::uint32_t width = 0, height = 0;
};

/// A chessboard looks the same turned by half (a square one by a quarter), and its first corner is
/// found at either end. Numbers the right image's corners as the left's are. True: they were
/// numbered another way.
bool same_order(const Board& board, View& view);

}  // namespace crane
