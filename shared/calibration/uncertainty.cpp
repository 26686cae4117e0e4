// SPDX-License-Identifier: Apache-2.0
#include "calibration/uncertainty.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "calibration/rays.hpp"

namespace crane {
namespace {

constexpr int kColumns = 17;
constexpr int kRows = 13;
constexpr Eigen::Index kNumbers = RigEstimate::kNumbers;

using Jacobian = Eigen::Matrix<double, 4, kNumbers>;

/// What the left camera sees at the grid's pixels.
std::vector<Eigen::Vector3d> grid_rays(const RigEstimate& rig, const ImageSize& size) {
  std::vector<Eigen::Vector2d> pixels;
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kColumns; ++c)
      pixels.emplace_back((size.width - 1.0) * c / (kColumns - 1),
                          (size.height - 1.0) * r / (kRows - 1));
  return rays(rig.left, pixels);
}

/// The rig's numbers, moved by `step` of one of them.
RigEstimate moved(const RigEstimate& rig, Eigen::Index number, double step) {
  RigEstimate out = rig;
  const auto n = static_cast<std::size_t>(number);
  if (n < kLensNumbers) {
    out.left[n] += step;
  } else if (n < 2 * kLensNumbers) {
    out.right[n - kLensNumbers] += step;
  } else if (n < 2 * kLensNumbers + 3) {
    // The covariance is of the rotation vector itself; near none it adds up.
    const Eigen::AngleAxisd turn(rig.T_right_left.linear());
    Eigen::Vector3d v = turn.angle() * turn.axis();
    v[number - Eigen::Index(2 * kLensNumbers)] += step;
    out.T_right_left.linear() = v.norm() > 0
                                    ? Eigen::AngleAxisd(v.norm(), v.normalized()).toRotationMatrix()
                                    : Eigen::Matrix3d::Identity();
  } else {
    out.T_right_left.translation()[number - Eigen::Index(2 * kLensNumbers + 3)] += step;
  }
  return out;
}

/// Where both cameras see a point of the left one's frame.
Eigen::Vector4d seen(const RigEstimate& rig, const Eigen::Vector3d& point) {
  Eigen::Vector4d out;
  project(rig.left.data(), point.data(), out.data());
  const Eigen::Vector3d p = rig.T_right_left * point;
  project(rig.right.data(), p.data(), out.data() + 2);
  return out;
}

Eigen::Matrix<double, 4, 3> by_point(const RigEstimate& rig, const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 4, 3> out;
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    step[i] = 1e-5 * point.z();
    out.col(i) = (seen(rig, point + step) - seen(rig, point - step)) / (2 * step[i]);
  }
  return out;
}

double step_of(Eigen::Index number) {
  const auto n = static_cast<std::size_t>(number) % kLensNumbers;
  if (number >= Eigen::Index(2 * kLensNumbers)) return 1e-6;
  return n < 4 ? 1e-3 : 1e-6;
}

/// Of the height that the point, triangulated, gets from what each camera sees.
Eigen::RowVector4d height_by_pixels(const RigEstimate& rig, const Eigen::Vector3d& point) {
  const Eigen::Matrix<double, 4, 3> J = by_point(rig, point);
  return (J.transpose() * J).ldlt().solve(J.transpose()).row(2);
}

ImageGrid grid_of(std::vector<double> values) {
  return {kColumns, kRows, std::move(values)};
}

}  // namespace

double ImageGrid::worst() const {
  return *std::max_element(values.begin(), values.end());
}

namespace {

double quantile(std::vector<double> values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

double ImageGrid::median() const {
  return quantile(values, 0.5);
}
double ImageGrid::most() const {
  return quantile(values, 0.95);
}

ImageGrid direction_sigma(const RigEstimate& rig, const ImageSize& size) {
  const auto points = grid_rays(rig, size);
  const auto rows = static_cast<Eigen::Index>(2 * points.size());
  Eigen::MatrixXd by_lens(rows, kLensNumbers);
  Eigen::MatrixXd by_turn(rows, 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 * i);
    for (Eigen::Index n = 0; n < Eigen::Index(kLensNumbers); ++n) {
      const double step = step_of(n);
      by_lens.block<2, 1>(at, n) =
          (seen(moved(rig, n, step), points[i]) - seen(moved(rig, n, -step), points[i])).head<2>() /
          (2 * step);
    }
    const Eigen::Matrix<double, 2, 3> J = by_point(rig, points[i]).topRows<2>();
    for (int axis = 0; axis < 3; ++axis)
      by_turn.block<2, 1>(at, axis) = J * Eigen::Vector3d::Unit(axis).cross(points[i]);
  }
  by_lens -= by_turn * by_turn.colPivHouseholderQr().solve(by_lens);
  const Eigen::MatrixXd S = rig.covariance.topLeftCorner<kLensNumbers, kLensNumbers>();
  std::vector<double> out;
  for (Eigen::Index at = 0; at < rows; at += 2) {
    const Eigen::Matrix2d of =
        by_lens.middleRows<2>(at) * S * by_lens.middleRows<2>(at).transpose();
    out.push_back(std::sqrt(of.diagonal().maxCoeff()));
  }
  return grid_of(std::move(out));
}

ImageGrid height_sigma(const RigEstimate& rig, const ImageSize& size, double distance_m) {
  std::vector<double> out;
  for (const auto& ray : grid_rays(rig, size)) {
    const Eigen::Vector3d point = distance_m * ray;
    Jacobian J;
    for (Eigen::Index n = 0; n < kNumbers; ++n) {
      const double step = step_of(n);
      J.col(n) =
          (seen(moved(rig, n, step), point) - seen(moved(rig, n, -step), point)) / (2 * step);
    }
    const Eigen::RowVectorXd of = height_by_pixels(rig, point) * J;
    out.push_back(std::sqrt((of * rig.covariance * of.transpose())(0)));
  }
  return grid_of(std::move(out));
}

ImageGrid height_difference(const RigEstimate& rig, const RigEstimate& other, const ImageSize& size,
                            double distance_m) {
  std::vector<double> out;
  for (const auto& ray : grid_rays(rig, size)) {
    const Eigen::Vector3d point = distance_m * ray;
    out.push_back(
        std::abs(height_by_pixels(other, point) * (seen(rig, point) - seen(other, point))));
  }
  return grid_of(std::move(out));
}

}  // namespace crane
