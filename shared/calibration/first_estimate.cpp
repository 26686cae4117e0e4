#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "calibration/bundle.hpp"

namespace crane {
namespace {

constexpr std::size_t kFewestViews = 5;  ///< of each camera, and of both at once
constexpr double kSameTurn_rad = 0.02;   ///< relations of the cameras that agree
constexpr double kSameShift = 0.1;       ///< of the baseline

/// One camera by itself.
struct Alone {
  LensNumbers lens{};
  std::vector<Eigen::Isometry3d> T_camera_board;  ///< of each view; identity where it saw nothing
};

Result<Alone> camera_alone(const std::vector<View>& views, const Board& board, bool right,
                           const ImageSize& size, LensModel model) {
  const auto corners = board.corners();
  std::vector<std::vector<cv::Point3f>> objects;
  std::vector<std::vector<cv::Point2f>> pixels;
  std::vector<std::size_t> which;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Corners& eye = right ? views[v].right : views[v].left;
    if (eye.empty()) continue;
    which.push_back(v);
    auto& o = objects.emplace_back();
    auto& p = pixels.emplace_back();
    for (std::size_t i = 0; i < eye.ids.size(); ++i) {
      const auto& c = corners[static_cast<std::size_t>(eye.ids[i])];
      o.emplace_back(static_cast<float>(c.x()), static_cast<float>(c.y()), 0.0F);
      p.emplace_back(static_cast<float>(eye.pixels[i].x()), static_cast<float>(eye.pixels[i].y()));
    }
  }
  const std::string name = right ? "right camera" : "left camera";
  if (which.size() < kFewestViews)
    return Error{ErrorCode::kBadData, name,
                 "sees the board in " + std::to_string(which.size()) + " views; at least " +
                     std::to_string(kFewestViews) + " are needed, 20 to 40 are good",
                 "take more pairs of images with the whole board in both"};
  cv::Mat K;
  cv::Mat D;
  std::vector<cv::Mat> turns;
  std::vector<cv::Mat> shifts;
  int flags = 0;
  if (model == LensModel::kRadialTangential) flags |= cv::CALIB_FIX_K3;
  if (model == LensModel::kRational) flags |= cv::CALIB_RATIONAL_MODEL;
  try {
    cv::calibrateCamera(objects, pixels, cv::Size(int(size.width), int(size.height)), K, D, turns,
                        shifts, flags);
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kBadData, name, std::string("cannot be calibrated: ") + e.err,
                 "tilt the board differently in each view"};
  }
  Alone out;
  out.lens = {K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2), K.at<double>(1, 2)};
  for (std::size_t i = 0; i + 4 < kLensNumbers && i < D.total(); ++i)
    out.lens[4 + i] = D.at<double>(static_cast<int>(i));
  for (const double number : out.lens)
    if (!std::isfinite(number))
      return Error{ErrorCode::kBadData, name, "cannot be calibrated from these views",
                   "tilt the board by 30 to 45 degrees, another way in each view"};
  out.T_camera_board.assign(views.size(), Eigen::Isometry3d::Identity());
  for (std::size_t i = 0; i < which.size(); ++i) {
    cv::Mat R;
    cv::Rodrigues(turns[i], R);
    Eigen::Matrix3d turn;
    Eigen::Vector3d shift;
    cv::cv2eigen(R, turn);
    cv::cv2eigen(shifts[i], shift);
    out.T_camera_board[which[i]].linear() = turn;
    out.T_camera_board[which[i]].translation() = shift;
  }
  return out;
}

}  // namespace

Result<RigEstimate> first_estimate(const std::vector<View>& views, const Board& board,
                                   const ImageSize& size, LensModel model) {
  auto left = camera_alone(views, board, false, size, model);
  if (!left) return left.error();
  auto right = camera_alone(views, board, true, size, model);
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
