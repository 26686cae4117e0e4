// SPDX-License-Identifier: Apache-2.0
#include "calibration/view.hpp"

#include <utility>

namespace crane {
namespace {

using Pixels = std::vector<Eigen::Vector2d>;

/// How far two sets of corners are from each other but for a shift: the cameras of a rig stand side
/// by side and look the same way.
double distance(const Pixels& a, const Pixels& b) {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) shift += a[i] - b[i];
  shift /= static_cast<double>(a.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i] - shift).squaredNorm();
  return sum;
}

/// The corners of a square board of n x n, turned by a quarter.
Pixels quarter_turn(const Pixels& from, int n) {
  Pixels out(from.size());
  for (int r = 0; r < n; ++r)
    for (int c = 0; c < n; ++c)
      out[static_cast<std::size_t>(r * n + c)] =
          from[static_cast<std::size_t>((n - 1 - c) * n + r)];
  return out;
}

}  // namespace

bool same_order(const Board& board, View& view) {
  if (board.kind != Board::Kind::kChessboard || view.left.empty() || view.right.empty())
    return false;
  const Pixels& left = view.left.pixels;
  Pixels best = view.right.pixels;
  double nearest = distance(left, best);
  bool turned = false;
  const auto consider = [&](Pixels pixels) {
    const double d = distance(left, pixels);
    if (d >= nearest) return;
    nearest = d;
    best = std::move(pixels);
    turned = true;
  };
  const Pixels& found = view.right.pixels;
  consider(Pixels(found.rbegin(), found.rend()));
  if (board.columns == board.rows) {
    const Pixels quarter = quarter_turn(found, board.rows);
    consider(quarter);
    consider(Pixels(quarter.rbegin(), quarter.rend()));
  }
  view.right.pixels = std::move(best);
  return turned;
}

}  // namespace crane
