// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "calibration/bundle.hpp"

namespace crane {
namespace {

constexpr std::size_t kFewestViews = 5;   ///< of each camera, and of both at once
constexpr std::size_t kEnoughViews = 20;  ///< for a start: the time grows with their third power
constexpr double kSameTurn_rad = 0.02;    ///< relations of the cameras that agree
constexpr double kSameShift = 0.1;        ///< of the baseline

/// One camera by itself.
struct Alone {
  LensNumbers lens{};
  std::vector<Eigen::Isometry3d> T_camera_board;  ///< of each view; identity where it saw nothing
};

/// What OpenCV wants of one view.
struct Points {
  std::size_t view = 0;
  std::vector<cv::Point3f> board;
  std::vector<cv::Point2f> pixels;
};

std::vector<Points> points_of(const std::vector<View>& views, const Board& board, bool right) {
  const auto corners = board.corners();
  std::vector<Points> out;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Corners& eye = right ? views[v].right : views[v].left;
    if (eye.empty()) continue;
    Points& points = out.emplace_back();
    points.view = v;
    for (std::size_t i = 0; i < eye.ids.size(); ++i) {
      const auto& c = corners[static_cast<std::size_t>(eye.ids[i])];
      points.board.emplace_back(static_cast<float>(c.x()), static_cast<float>(c.y()), 0.0F);
      points.pixels.emplace_back(static_cast<float>(eye.pixels[i].x()),
                                 static_cast<float>(eye.pixels[i].y()));
    }
  }
  return out;
}

Result<Alone> camera_alone(const std::vector<View>& views, const Board& board, bool right,
                           const ImageSize& size) {
  const auto all = points_of(views, board, right);
  const std::string name = right ? "right camera" : "left camera";
  if (all.size() < kFewestViews)
    return Error{ErrorCode::kBadData, name,
                 "sees the board in " + std::to_string(all.size()) + " views; at least " +
                     std::to_string(kFewestViews) + " are needed, 20 to 40 are good",
                 "take more pairs of images with the whole board in both"};
  std::vector<std::vector<cv::Point3f>> some_boards;
  std::vector<std::vector<cv::Point2f>> some_pixels;
  const std::size_t step = (all.size() + kEnoughViews - 1) / kEnoughViews;
  for (std::size_t i = 0; i < all.size(); i += step) {
    some_boards.push_back(all[i].board);
    some_pixels.push_back(all[i].pixels);
  }
  cv::Mat K;
  cv::Mat D;
  Alone out;
  out.T_camera_board.assign(views.size(), Eigen::Isometry3d::Identity());
  try {
    cv::Mat turn;
    cv::Mat shift;
    std::vector<cv::Mat> turns;
    std::vector<cv::Mat> shifts;
    cv::calibrateCamera(some_boards, some_pixels, cv::Size(int(size.width), int(size.height)), K, D,
                        turns, shifts, cv::CALIB_FIX_K3);
    for (const Points& points : all) {
      cv::Mat R;
      cv::solvePnP(points.board, points.pixels, K, D, turn, shift);
      cv::Rodrigues(turn, R);
      using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
      Eigen::Isometry3d& T = out.T_camera_board[points.view];
      T.linear() = Eigen::Map<const RowMajor>(R.ptr<double>());
      T.translation() = Eigen::Map<const Eigen::Vector3d>(shift.ptr<double>());
    }
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kBadData, name, "cannot be calibrated: " + e.err,
                 "tilt the board differently in each view"};
  }
  out.lens = {K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2), K.at<double>(1, 2)};
  for (std::size_t i = 0; i < 4; ++i) out.lens[4 + i] = D.at<double>(static_cast<int>(i));
  for (const double number : out.lens)
    if (!std::isfinite(number))
      return Error{ErrorCode::kBadData, name, "cannot be calibrated from these views",
                   "tilt the board by 30 to 45 degrees, another way in each view"};
  return out;
}

}  // namespace

Result<RigEstimate> first_estimate(const std::vector<View>& views, const Board& board,
                                   const ImageSize& size) {
  auto left = camera_alone(views, board, false, size);
  if (!left) return left.error();
  auto right = camera_alone(views, board, true, size);
  if (!right) return right.error();

  std::vector<Eigen::Isometry3d> relations;
  for (std::size_t v = 0; v < views.size(); ++v)
    if (!views[v].left.empty() && !views[v].right.empty())
      relations.push_back(right->T_camera_board[v] * left->T_camera_board[v].inverse());
  if (relations.size() < kFewestViews)
    return Error{ErrorCode::kBadData, "calibration",
                 "both cameras see the board in " + std::to_string(relations.size()) +
                     " views; at least " + std::to_string(kFewestViews) + " are needed",
                 "hold the board where both cameras see it whole"};
  std::size_t best = 0;
  std::size_t most = 0;
  for (std::size_t i = 0; i < relations.size(); ++i) {
    const double reach = kSameShift * relations[i].translation().norm();
    const auto agree = std::count_if(relations.begin(), relations.end(), [&](const auto& other) {
      const Eigen::Isometry3d between = relations[i].inverse() * other;
      return Eigen::AngleAxisd(between.linear()).angle() < kSameTurn_rad &&
             (relations[i].translation() - other.translation()).norm() < reach;
    });
    if (static_cast<std::size_t>(agree) <= most) continue;
    most = static_cast<std::size_t>(agree);
    best = i;
  }
  RigEstimate out;
  out.left = left->lens;
  out.right = right->lens;
  out.T_right_left = relations[best];
  for (std::size_t v = 0; v < views.size(); ++v)
    out.T_left_board.push_back(views[v].left.empty()
                                   ? out.T_right_left.inverse() * right->T_camera_board[v]
                                   : left->T_camera_board[v]);
  return out;
}

}  // namespace crane
