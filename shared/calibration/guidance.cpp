// SPDX-License-Identifier: Apache-2.0
#include "calibration/guidance.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "base/format.hpp"

namespace crane {
namespace {

constexpr int kFewCorners = 10;        ///< in a part of the image
constexpr double kTilted_rad = 0.35;   ///< reached: no more is asked that way
constexpr double kAsk_rad = 0.6;       ///< asked, where it is not
constexpr double kCloseUp = 0.4;       ///< of the image's width
constexpr double kMoved_px = 2;        ///< between two pairs: the board is not at rest
constexpr double kAlike = 0.02;        ///< of the image's width: the same view again
constexpr double kFarAway = 0.12;      ///< of the image's width: corners too near each other
constexpr int kInBoth = 6;             ///< views that both cameras have, before one alone will do
constexpr double kGuessedFocal = 0.9;  ///< of the image's width

/// Largest distance of the corners that both have [px]; nothing: they have too few in common.
std::optional<double> apart(const Corners& a, const Corners& b) {
  double most = 0;
  int count = 0;
  for (std::size_t i = 0, j = 0; i < a.ids.size() && j < b.ids.size();) {
    if (a.ids[i] == b.ids[j]) {
      most = std::max(most, (a.pixels[i] - b.pixels[j]).norm());
      ++count;
      ++i;
      ++j;
    } else {
      ++(a.ids[i] < b.ids[j] ? i : j);
    }
  }
  if (count < 4) return std::nullopt;
  return most;
}

std::string place_words(int column, int row) {
  static constexpr const char* kRow[] = {"upper ", "", "lower "};
  static constexpr const char* kColumn[] = {"left", "middle, a little left,",
                                            "middle, a little right,", "right"};
  return std::string(kRow[row]) + kColumn[column];
}

/// Which way the board was tilted least, and how far that was.
struct Tilt {
  double x = 0, y = 0, reached = 0;
  const char* words = "";
};
Tilt least_tilted(const Coverage& c) {
  const Tilt ways[] = {
      {kAsk_rad, 0, c.tilt_x_rad[1], "its lower edge turned towards the camera"},
      {-kAsk_rad, 0, -c.tilt_x_rad[0], "its upper edge turned towards the camera"},
      {0, kAsk_rad, c.tilt_y_rad[1], "its right edge turned towards the camera"},
      {0, -kAsk_rad, -c.tilt_y_rad[0], "its left edge turned towards the camera"},
  };
  return *std::min_element(std::begin(ways), std::end(ways),
                           [](const Tilt& a, const Tilt& b) { return a.reached < b.reached; });
}

}  // namespace

std::optional<NextView> next_view(const Coverage& coverage) {
  NextView next;
  std::size_t part = 0;
  for (const bool right : {false, true})
    for (std::size_t i = 0; i < coverage.corners[0].size(); ++i)
      if (coverage.corners[right ? 1 : 0][i] < coverage.corners[next.right ? 1 : 0][part]) {
        part = i;
        next.right = right;
      }
  const Tilt tilt = least_tilted(coverage);
  const bool tilted = tilt.reached >= kTilted_rad;
  if (coverage.corners[next.right ? 1 : 0][part] >= kFewCorners && tilted &&
      coverage.largest >= kCloseUp)
    return std::nullopt;
  const int column = static_cast<int>(part) % Coverage::kColumns;
  const int row = static_cast<int>(part) / Coverage::kColumns;
  // A board that must be whole reaches into a corner of the image with its edge, not its middle.
  next.x = std::clamp((column + 0.5) / Coverage::kColumns, next.width / 2 + 0.02,
                      1 - next.width / 2 - 0.02);
  next.y = std::clamp((row + 0.5) / Coverage::kRows, 0.32, 0.68);
  next.words = "hold the board in the " + place_words(column, row) + " of the " +
               (next.right ? "right" : "left") +
               " image, so near that it fills half of the width, ";
  if (tilted) {
    next.words += "upright";
  } else {
    next.tilt_x_rad = tilt.x;
    next.tilt_y_rad = tilt.y;
    next.words += std::string(tilt.words) + " by about 35 degrees";
  }
  return next;
}

std::array<Eigen::Vector2d, 4> outline(const NextView& next, const Board& board,
                                       const ImageSize& size) {
  const double f = kGuessedFocal * size.width;
  const auto corners = board.corners();
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();
  for (const auto& c : corners) extent = extent.cwiseMax(c);
  const double away = f * extent.x() / (next.width * size.width);
  const Eigen::Matrix3d R = (Eigen::AngleAxisd(-next.tilt_x_rad, Eigen::Vector3d::UnitX()) *
                             Eigen::AngleAxisd(next.tilt_y_rad, Eigen::Vector3d::UnitY()))
                                .toRotationMatrix();
  std::array<Eigen::Vector2d, 4> out;
  static constexpr double kSides[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Eigen::Vector3d p =
        R * Eigen::Vector3d(kSides[i][0] * extent.x(), kSides[i][1] * extent.y(), 0);
    out[i] = {next.x * size.width + f * p.x() / (away + p.z()),
              next.y * size.height + f * p.y() / (away + p.z())};
  }
  return out;
}

Coverage rough_coverage(const std::vector<View>& views, const Board& board, const ImageSize& size) {
  const double f = kGuessedFocal * size.width;
  const cv::Matx33d K(f, 0, size.width / 2.0, 0, f, size.height / 2.0, 0, 0, 1);
  const auto corners = board.corners();
  std::vector<Eigen::Isometry3d> poses;
  for (const View& view : views) {
    const Corners& eye = view.left.empty() ? view.right : view.left;
    if (eye.ids.size() < 4) continue;
    std::vector<cv::Point3d> points;
    std::vector<cv::Point2d> pixels;
    for (std::size_t i = 0; i < eye.ids.size(); ++i) {
      const Eigen::Vector3d& p = corners[static_cast<std::size_t>(eye.ids[i])];
      points.emplace_back(p.x(), p.y(), p.z());
      pixels.emplace_back(eye.pixels[i].x(), eye.pixels[i].y());
    }
    cv::Vec3d r, t;
    try {
      if (!cv::solvePnP(points, pixels, K, cv::noArray(), r, t, false, cv::SOLVEPNP_IPPE)) continue;
    } catch (const cv::Exception&) {
      continue;  // corners in one line say no pose
    }
    const Eigen::Vector3d turn(r[0], r[1], r[2]);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    if (turn.norm() > 0)
      T.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    poses.push_back(T);
  }
  return coverage_of(views, size, poses);
}

std::string ViewGate::refuse(const View& view) {
  const View before = std::exchange(before_, view);
  if (view.left.empty() && view.right.empty()) return "no board in either image";
  const auto in_both = std::count_if(kept_.begin(), kept_.end(), [](const View& v) {
    return !v.left.empty() && !v.right.empty();
  });
  // Near the outer edges only one camera sees a whole board; that tells of its lens, but not of the
  // relation of both.
  for (const bool right : {false, true})
    if ((right ? view.right : view.left).empty() && in_both < kInBoth)
      return std::string("no board in the ") + (right ? "right" : "left") +
             " image: the first views must show the whole board, with its white border, in both";
  const bool left = !view.left.empty();
  const auto eye_of = [left](const View& v) -> const Corners& { return left ? v.left : v.right; };
  const auto moved = apart(eye_of(view), eye_of(before));
  if (!moved) return "the board has just come: hold it still";
  if (*moved > kMoved_px) return formatted("the board moves (%.0f px): hold it still", *moved);
  const Coverage here = coverage_of({view}, size_, {});
  if (here.largest < kFarAway)
    return formatted("too far away: the board fills %.0f %% of the width, half is good",
                     100 * here.largest);
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    const auto off = apart(eye_of(view), eye_of(kept_[i]));
    if (off && *off < kAlike * size_.width)
      return "as view " + std::to_string(i + 1) + ": move it or tilt it another way";
  }
  kept_.push_back(view);
  return "";
}

}  // namespace crane
