// SPDX-License-Identifier: Apache-2.0
#include "calibration/board.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/format.hpp"

namespace crane {
namespace {

constexpr int kMost = 60;  ///< corners or tags a side
constexpr double kSmallest_m = 0.002;
constexpr double kLargest_m = 1.0;  ///< a square of a metre: millimetres were meant

std::vector<std::string> fields_of(const std::string& text) {
  std::vector<std::string> out(1);
  for (const char c : text)
    if (c == ':')
      out.emplace_back();
    else
      out.back() += c;
  return out;
}

template <class Number>
bool read_number(const std::string& text, Number& out) {
  const char* end = text.data() + text.size();
  const auto [at, failed] = std::from_chars(text.data(), end, out);
  return failed == std::errc() && at == end && !text.empty();
}

}  // namespace

std::vector<Eigen::Vector3d> Board::corners() const {
  std::vector<Eigen::Vector3d> out;
  if (kind != Kind::kAprilGrid) {
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) out.emplace_back(c * square_m, r * square_m, 0);
    return out;
  }
  // Tag after tag along a row; of each its corners in the order of the detector: clockwise from the
  // upper left one.
  const double step = square_m + marker_m;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      for (int k = 0; k < 4; ++k)
        out.emplace_back(c * step + (k == 1 || k == 2 ? square_m : 0),
                         r * step + (k >= 2 ? square_m : 0), 0);
  return out;
}

double Board::size_m() const {
  const auto all = corners();
  return all.empty() ? 0 : (all.back() - all.front()).norm();
}

std::string Board::text() const {
  const char* name = kind == Kind::kChessboard ? "chessboard"
                     : kind == Kind::kCharuco  ? "ChArUco board"
                                               : "AprilGrid";
  return formatted("%s of %d x %d %s, %s %g mm", name, columns, rows,
                   kind == Kind::kAprilGrid ? "tags" : "inner corners",
                   kind == Kind::kAprilGrid ? "tags of" : "squares of", 1000 * square_m);
}

Result<Board> parse_board(const std::string& text) {
  const auto bad = [&text](const std::string& what) {
    return Error{ErrorCode::kConfiguration, "--board " + text, what,
                 "write chessboard:9x6:0.025 (inner corners, square in metres), "
                 "charuco:11x8:0.03:0.022:5X5_100 (and marker, dictionary) or "
                 "aprilgrid:6x6:0.088:0.3 (tags, their side in metres, gap as a part of it)"};
  };
  const auto fields = fields_of(text);
  Board board;
  std::size_t count = 3;
  if (fields[0] == "chessboard") {
    board.kind = Board::Kind::kChessboard;
  } else if (fields[0] == "charuco") {
    board.kind = Board::Kind::kCharuco;
    count = 5;
  } else if (fields[0] == "aprilgrid") {
    board.kind = Board::Kind::kAprilGrid;
    count = 4;
  } else {
    return bad("is no kind of board");
  }
  if (fields.size() != count)
    return bad("has " + std::to_string(fields.size()) + " fields instead of " +
               std::to_string(count));
  const auto cross = fields[1].find('x');
  if (cross == std::string::npos || !read_number(fields[1].substr(0, cross), board.columns) ||
      !read_number(fields[1].substr(cross + 1), board.rows))
    return bad("'" + fields[1] + "' is no COLUMNSxROWS");
  const int least = board.kind == Board::Kind::kAprilGrid ? 1 : 3;
  if (std::min(board.columns, board.rows) < least || std::max(board.columns, board.rows) > kMost)
    return bad("each side has " + std::to_string(least) + " to " + std::to_string(kMost));
  if (!read_number(fields[2], board.square_m) || !(board.square_m >= kSmallest_m))
    return bad("'" + fields[2] + "' is no length in metres");
  if (board.square_m > kLargest_m)
    return bad("a side of " + fields[2] + " m: were millimetres meant?");
  if (count > 3) {
    if (!read_number(fields[3], board.marker_m) || !(board.marker_m > 0))
      return bad("'" + fields[3] + "' is no length");
    if (board.kind == Board::Kind::kAprilGrid) board.marker_m *= board.square_m;
    if (board.marker_m >= board.square_m)
      return bad(board.kind == Board::Kind::kCharuco ? "the marker is not smaller than its square"
                                                     : "the gap is not smaller than a tag");
  }
  if (count > 4) board.dictionary = fields[4];
  return board;
}

}  // namespace crane
