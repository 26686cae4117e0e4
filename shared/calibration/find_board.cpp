// SPDX-License-Identifier: Apache-2.0
#include "calibration/find_board.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "imaging/convert.hpp"

namespace crane {
namespace {

constexpr std::size_t kFewest = 8;  ///< corners; a pose has six numbers

const std::map<std::string, int>& dictionaries() {
  namespace a = cv::aruco;
  static const std::map<std::string, int> kAll = {
      {"4X4_50", a::DICT_4X4_50},
      {"4X4_100", a::DICT_4X4_100},
      {"4X4_250", a::DICT_4X4_250},
      {"4X4_1000", a::DICT_4X4_1000},
      {"5X5_50", a::DICT_5X5_50},
      {"5X5_100", a::DICT_5X5_100},
      {"5X5_250", a::DICT_5X5_250},
      {"5X5_1000", a::DICT_5X5_1000},
      {"6X6_50", a::DICT_6X6_50},
      {"6X6_100", a::DICT_6X6_100},
      {"6X6_250", a::DICT_6X6_250},
      {"6X6_1000", a::DICT_6X6_1000},
      {"7X7_250", a::DICT_7X7_250},
      {"ARUCO_ORIGINAL", a::DICT_ARUCO_ORIGINAL},
      {"APRILTAG_36h11", a::DICT_APRILTAG_36h11},
  };
  return kAll;
}

/// Half the window of the corner refinement where neighbours are `nearest` pixels away.
cv::Size window_of(double nearest) {
  const int half = std::clamp(static_cast<int>(nearest * 0.4), 2, 11);
  return {half, half};
}

void refine(const cv::Mat& grey, std::vector<cv::Point2f>& corners, const cv::Size& window) {
  cv::cornerSubPix(grey, corners, window, {-1, -1},
                   {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 60, 0.002});
}

Corners chessboard(const cv::Mat& grey, int columns, int rows) {
  std::vector<cv::Point2f> found;
  const cv::Size size(columns, rows);
  if (!cv::findChessboardCorners(
          grey, size, found,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK) &&
      !cv::findChessboardCornersSB(grey, size, found, cv::CALIB_CB_NORMALIZE_IMAGE))
    return {};
  double nearest = 1e9;
  for (std::size_t i = 1; i < found.size(); ++i)
    if (i % static_cast<std::size_t>(columns) != 0)
      nearest = std::min(nearest, cv::norm(found[i] - found[i - 1]));
  refine(grey, found, window_of(nearest));
  Corners out;
  for (std::size_t i = 0; i < found.size(); ++i) {
    out.ids.push_back(static_cast<int>(i));
    out.pixels.emplace_back(found[i].x, found[i].y);
  }
  return out;
}

/// By rising id, without corners that are there twice.
Corners sorted(std::map<int, Eigen::Vector2d>& found) {
  Corners out;
  for (const auto& [id, pixel] : found) {
    out.ids.push_back(id);
    out.pixels.push_back(pixel);
  }
  if (out.ids.size() < kFewest) return {};
  return out;
}

Corners charuco(const cv::Mat& grey, const Board& board, int dictionary) {
  const auto markers = cv::aruco::getPredefinedDictionary(dictionary);
  const auto layout = cv::aruco::CharucoBoard::create(board.columns + 1, board.rows + 1,
                                                      static_cast<float>(board.square_m),
                                                      static_cast<float>(board.marker_m), markers);
  std::vector<std::vector<cv::Point2f>> tags;
  std::vector<int> tag_ids;
  cv::aruco::detectMarkers(grey, markers, tags, tag_ids);
  std::map<int, Eigen::Vector2d> found;
  if (tag_ids.empty()) return {};
  std::vector<cv::Point2f> corners;
  std::vector<int> ids;
  cv::aruco::interpolateCornersCharuco(tags, tag_ids, grey, layout, corners, ids);
  if (ids.empty()) return {};
  // Once more by ourselves: what comes back counts from the first pixel's corner, not its middle.
  const double square = cv::norm(tags[0][1] - tags[0][0]) * board.square_m / board.marker_m;
  for (auto& corner : corners) corner -= cv::Point2f(0.5F, 0.5F);
  // Up to the markers and no further: their corners would pull.
  refine(grey, corners, window_of(square * (1 - board.marker_m / board.square_m)));
  for (std::size_t i = 0; i < ids.size(); ++i) found[ids[i]] = {corners[i].x, corners[i].y};
  return sorted(found);
}

Corners april_grid(const cv::Mat& grey, const Board& board, int dictionary) {
  const auto markers = cv::aruco::getPredefinedDictionary(dictionary);
  std::vector<std::vector<cv::Point2f>> best;
  std::vector<int> best_ids;
  for (const int border : {2, 1}) {  // Kalibr prints tags with a border of two bits, others of one
    auto how = cv::aruco::DetectorParameters::create();
    how->markerBorderBits = border;
    std::vector<std::vector<cv::Point2f>> tags;
    std::vector<int> ids;
    cv::aruco::detectMarkers(grey, markers, tags, ids, how);
    if (ids.size() <= best_ids.size()) continue;
    best = std::move(tags);
    best_ids = std::move(ids);
  }
  std::map<int, Eigen::Vector2d> found;
  for (std::size_t t = 0; t < best_ids.size(); ++t) {
    if (best_ids[t] >= board.columns * board.rows) continue;
    const double gap = cv::norm(best[t][1] - best[t][0]) * board.marker_m / board.square_m;
    refine(grey, best[t], window_of(gap));
    for (std::size_t k = 0; k < 4; ++k)
      found[4 * best_ids[t] + static_cast<int>(k)] = {best[t][k].x, best[t][k].y};
  }
  return sorted(found);
}

}  // namespace

Result<BoardFinder> BoardFinder::of(const Board& board) {
  const auto bad = [&board](const std::string& what, const std::string& todo) {
    return Error{ErrorCode::kConfiguration, board.text(), what, todo};
  };
  if (board.kind == Board::Kind::kChessboard) return BoardFinder(board, -1);
  const std::string name =
      board.kind == Board::Kind::kAprilGrid ? "APRILTAG_36h11" : board.dictionary;
  const auto known = dictionaries().find(name);
  if (known == dictionaries().end()) {
    std::string all;
    for (const auto& [each, number] : dictionaries()) all += (all.empty() ? "" : ", ") + each;
    return bad("'" + name + "' is no dictionary of markers", "one of: " + all);
  }
  const int tags = board.kind == Board::Kind::kAprilGrid
                       ? board.columns * board.rows
                       : (board.columns + 1) * (board.rows + 1) / 2;
  if (tags > cv::aruco::getPredefinedDictionary(known->second)->bytesList.rows)
    return bad("has more markers (" + std::to_string(tags) + ") than dictionary " + name,
               "give the dictionary that the board was printed with");
  return BoardFinder(board, known->second);
}

Corners BoardFinder::find(const Image& image) const {
  std::vector<std::uint8_t> bytes;
  if (!to_grey(image.view(), bytes)) return {};
  const cv::Mat grey(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC1,
                     bytes.data());
  switch (board_.kind) {
    case Board::Kind::kChessboard:
      return chessboard(grey, board_.columns, board_.rows);
    case Board::Kind::kCharuco:
      return charuco(grey, board_, dictionary_);
    case Board::Kind::kAprilGrid:
      return april_grid(grey, board_, dictionary_);
  }
  return {};
}

std::string BoardFinder::other_board(const Image& image) const {
  std::vector<std::uint8_t> bytes;
  if (!to_grey(image.view(), bytes)) return {};
  const cv::Mat grey(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC1,
                     bytes.data());
  if (board_.kind != Board::Kind::kChessboard) return {};
  for (int off = 1; off <= 4; ++off)  // the likeliest first: squares counted instead of corners
    for (int c = std::min(2, off); c >= -std::min(2, off); --c)
      for (const int r : {off - std::abs(c), std::abs(c) - off}) {
        const int columns = board_.columns + c;
        const int rows = board_.rows + r;
        if (std::abs(r) <= 2 && std::min(columns, rows) >= 3 &&
            !chessboard(grey, columns, rows).empty())
          return std::to_string(columns) + "x" + std::to_string(rows);
      }
  return {};
}

}  // namespace crane
