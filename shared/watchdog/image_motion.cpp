// SPDX-License-Identifier: Apache-2.0
#include "watchdog/image_motion.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "motion/align.hpp"

namespace crane {
namespace {

constexpr int kLeastPatches = 20;
constexpr double kLeastSupport = 0.4;
constexpr double kReach = 0.15;        ///< as a share of the camera's height
constexpr double kLeastOverlap = 0.2;  ///< to be compared at all
/// Of frames that fit nowhere so many are looked for far around, then every so many: it is dear.
constexpr int kLookFar = 3, kLookFarEvery = 10;

}  // namespace

std::optional<ImageMotion::Seen> ImageMotion::measure(const DepthFrame& frame, TimeNs exposure,
                                                      const Eigen::Vector2d& expected_off_m) {
  last_.reset();
  overlap_ = 0;
  if (frame.colour == nullptr) return std::nullopt;
  last_ = placed_image(frame, exposure);
  if (!key_) return std::nullopt;
  const Eigen::Vector3d way_m =
      frame.T_map_rectified.translation() - key_->T_map_rectified.translation();
  const Eigen::Vector3d way_px =
      frame.f_px / height_m_ * (frame.T_map_rectified.linear().transpose() * way_m);
  overlap_ = std::max(0.0, 1 - std::abs(way_px.x()) / frame.width) *
             std::max(0.0, 1 - std::abs(way_px.y()) / frame.height);
  if (overlap_ < kLeastOverlap) return std::nullopt;
  // As if it lay where it is expected.
  PlacedImage image = *std::move(last_);
  const Eigen::Vector3d told_m = image.T_map_rectified.translation();
  image.T_map_rectified.translation().head<2>() += expected_off_m;
  const auto fits = [](const std::optional<Alignment>& a) {
    return a && !a->ambiguous && a->patches >= kLeastPatches && a->support >= kLeastSupport;
  };
  auto found = align(frame, image, *key_);
  if (!fits(found) && (lost_ < kLookFar || lost_ % kLookFarEvery == 0))
    found = align(frame, image, *key_, {kReach * height_m_});
  image.T_map_rectified.translation() = told_m;
  last_ = std::move(image);
  if (!fits(found)) {
    ++lost_;
    return std::nullopt;
  }
  lost_ = 0;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(found->covariance_m2);
  return Seen{expected_off_m + found->correction_m,
              std::sqrt(std::max(0.0, eigen.eigenvalues()[0]))};
}

bool ImageMotion::make_key() {
  if (!last_) return false;
  key_ = last_;
  return true;
}

}  // namespace crane
