// SPDX-License-Identifier: Apache-2.0
#include "calibration/bundle.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

constexpr std::size_t kViewsForWarp = 8;
constexpr double kFarOff_px = 0.7;  ///< a corner's error that the robust fit begins to doubt

/// Rotation vector and translation.
using Pose = std::array<double, 6>;

Pose pose_of(const Eigen::Isometry3d& T) {
  const Eigen::AngleAxisd turn(T.linear());
  const Eigen::Vector3d r = turn.angle() * turn.axis();
  const Eigen::Vector3d t = T.translation();
  return {r.x(), r.y(), r.z(), t.x(), t.y(), t.z()};
}

Eigen::Isometry3d isometry_of(const Pose& pose) {
  const Eigen::Vector3d r(pose[0], pose[1], pose[2]);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (r.norm() > 0) T.linear() = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
  T.translation() << pose[3], pose[4], pose[5];
  return T;
}

template <class Number>
void transform(const Number* pose, const Number* in, Number* out) {
  ceres::AngleAxisRotatePoint(pose, in, out);
  for (int i = 0; i < 3; ++i) out[i] += pose[3 + i];
}

/// A corner on the board as it is warped; `on` is its place in the board, -1 .. 1. The shape is
/// that of mrcal's calobject_warp: a paraboloid, 0 at the corners of the board.
template <class Number>
void warped(const Eigen::Vector3d& corner, const Eigen::Vector2d& on, const Number* warp,
            Number* out) {
  out[0] = Number(corner.x());
  out[1] = Number(corner.y());
  out[2] = warp[0] * (1 - on.x() * on.x()) + warp[1] * (1 - on.y() * on.y());
}

struct CornerError {
  Eigen::Vector3d corner;
  Eigen::Vector2d on, seen;

  template <class Number>
  bool off(const Number* lens, const Number* in_camera, Number* error) const {
    if (in_camera[2] < Number(1e-3)) return false;  // behind the camera
    project(lens, in_camera, error);
    error[0] = Number(seen.x()) - error[0];
    error[1] = Number(seen.y()) - error[1];
    return true;
  }
  /// Seen by the left camera.
  template <class Number>
  bool operator()(const Number* lens, const Number* board, const Number* warp,
                  Number* error) const {
    Number on_board[3], in_camera[3];
    warped(corner, on, warp, on_board);
    transform(board, on_board, in_camera);
    return off(lens, in_camera, error);
  }
  /// Seen by the right one.
  template <class Number>
  bool operator()(const Number* lens, const Number* rig, const Number* board, const Number* warp,
                  Number* error) const {
    Number on_board[3], in_left[3], in_camera[3];
    warped(corner, on, warp, on_board);
    transform(board, on_board, in_left);
    transform(rig, in_left, in_camera);
    return off(lens, in_camera, error);
  }
};

/// Places of all corners in the board, -1 .. 1.
std::vector<Eigen::Vector2d> places(const std::vector<Eigen::Vector3d>& corners) {
  Eigen::Vector2d most(1e-9, 1e-9);
  for (const auto& c : corners) most = most.cwiseMax(c.head<2>());
  std::vector<Eigen::Vector2d> out;
  for (const auto& c : corners)
    out.emplace_back((2 * c.head<2>().array() / most.array() - 1).matrix());
  return out;
}

/// The state of the solver, in the blocks it wants.
struct Blocks {
  LensNumbers left, right;
  Pose rig;
  std::array<double, 2> warp;
  std::vector<Pose> boards;
};

Eigen::MatrixXd covariance_of(ceres::Problem& problem, Blocks& b) {
  ceres::Covariance::Options how;
  how.algorithm_type = ceres::SPARSE_QR;
  ceres::Covariance covariance(how);
  const std::vector<const double*> blocks = {b.left.data(), b.right.data(), b.rig.data()};
  if (!covariance.Compute(blocks, &problem)) return {};
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> out(RigEstimate::kNumbers,
                                                                             RigEstimate::kNumbers);
  if (!covariance.GetCovarianceMatrix(blocks, out.data())) return {};
  return out;
}

}  // namespace

double RigEstimate::baseline_sigma_m() const {
  if (covariance.size() == 0) return 0;
  const Eigen::Vector3d along = T_right_left.translation().normalized();
  const Eigen::Index at = kNumbers - 3;
  return std::sqrt(along.dot(covariance.block<3, 3>(at, at) * along));
}

std::vector<Residual> residuals(const std::vector<View>& views, const Board& board,
                                const RigEstimate& rig) {
  const auto corners = board.corners();
  const auto on = places(corners);
  std::vector<Residual> out;
  for (std::size_t v = 0; v < views.size(); ++v)
    for (const bool right : {false, true}) {
      const Corners& eye = right ? views[v].right : views[v].left;
      const Eigen::Isometry3d T =
          right ? rig.T_right_left * rig.T_left_board[v] : rig.T_left_board[v];
      for (std::size_t i = 0; i < eye.ids.size(); ++i) {
        const auto id = static_cast<std::size_t>(eye.ids[i]);
        Eigen::Vector3d p;
        warped(corners[id], on[id], rig.warp_m.data(), p.data());
        p = T * p;
        Eigen::Vector2d pixel;
        project((right ? rig.right : rig.left).data(), p.data(), pixel.data());
        out.push_back({v, i, right, eye.pixels[i], eye.pixels[i] - pixel});
      }
    }
  return out;
}

Result<RigEstimate> refine(const std::vector<View>& views, const Board& board,
                           const RigEstimate& from, LensFit model, bool robust) {
  const auto corners = board.corners();
  const auto on = places(corners);
  Blocks b{
      from.left, from.right, pose_of(from.T_right_left), {from.warp_m.x(), from.warp_m.y()}, {}};
  for (const auto& T : from.T_left_board) b.boards.push_back(pose_of(T));

  ceres::Problem problem;
  std::size_t seen = 0;
  for (std::size_t v = 0; v < views.size(); ++v)
    for (const bool right : {false, true}) {
      const Corners& eye = right ? views[v].right : views[v].left;
      for (std::size_t i = 0; i < eye.ids.size(); ++i) {
        const auto id = static_cast<std::size_t>(eye.ids[i]);
        auto* error = new CornerError{corners[id], on[id], eye.pixels[i]};
        auto* loss = robust ? new ceres::CauchyLoss(kFarOff_px) : nullptr;
        ++seen;
        if (right)
          problem.AddResidualBlock(
              new ceres::AutoDiffCostFunction<CornerError, 2, 12, 6, 6, 2>(error), loss,
              b.right.data(), b.rig.data(), b.boards[v].data(), b.warp.data());
        else
          problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CornerError, 2, 12, 6, 2>(error),
                                   loss, b.left.data(), b.boards[v].data(), b.warp.data());
      }
    }
  std::vector<int> fixed;
  for (std::size_t i = estimated(model); i < kLensNumbers; ++i)
    fixed.push_back(static_cast<int>(i));
  if (!fixed.empty())
    for (double* lens : {b.left.data(), b.right.data()})
      problem.SetManifold(lens, new ceres::SubsetManifold(kLensNumbers, fixed));
  const bool with_warp = views.size() >= kViewsForWarp;
  if (!with_warp) problem.SetParameterBlockConstant(b.warp.data());

  ceres::Solver::Options how;
  how.linear_solver_type = ceres::DENSE_SCHUR;
  how.max_num_iterations = 200;
  how.function_tolerance = 1e-10;
  how.num_threads = 2;
  how.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  if (!summary.IsSolutionUsable())
    return Error{ErrorCode::kBadData, "calibration", "no rig explains these views",
                 "check the board's size and that left and right were not mixed up"};

  RigEstimate out;
  out.left = b.left;
  out.right = b.right;
  out.T_right_left = isometry_of(b.rig);
  out.warp_m = {b.warp[0], b.warp[1]};
  for (const Pose& pose : b.boards) out.T_left_board.push_back(isometry_of(pose));
  const double unknowns =
      static_cast<double>(2 * estimated(model) + 6 + (with_warp ? 2 : 0) + 6 * views.size());
  const double freedom = 2 * static_cast<double>(seen) - unknowns;
  if (freedom <= 0)
    return Error{ErrorCode::kBadData, "calibration", "fewer corners than unknowns",
                 "take more views of the board"};
  if (robust) return out;
  out.sigma_px = std::sqrt(2 * summary.final_cost / freedom);
  out.covariance = covariance_of(problem, b) * out.sigma_px * out.sigma_px;
  if (out.covariance.size() == 0 || !out.covariance.allFinite())
    return Error{ErrorCode::kBadData, "calibration",
                 "the views leave something of the cameras open",
                 "tilt the board in both directions and hold it in all parts of the image"};
  return out;
}

}  // namespace crane
