// SPDX-License-Identifier: Apache-2.0
#include "motion/views.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

/// Of the camera's height: shorter displacements tell hardly more than the pair, longer ones see
/// other things.
constexpr double kShortest = 0.02, kLongest = 0.3;
constexpr double kPosition_m = 0.002;  ///< standard deviation of a place, by the rangefinders
/// A correction beyond so many sigmas, or metres, is a wrong position.
constexpr double kMisplaced = 5, kMisplaced_m = 0.1;
/// Where the camera would have been at a steady speed, and where it was, must differ by this share
/// of the longest displacement.
constexpr double kUnsteady = 0.15;

Eigen::Vector2d displacement(const PlacedImage& image, const PlacedImage& other) {
  return (image.T_map_rectified.translation() - other.T_map_rectified.translation()).head<2>();
}

/// The measured correction and what the rangefinders say, weighted by their uncertainty.
bool refine(const Alignment& a, MotionView& view) {
  const Eigen::Matrix2d prior = 2 * kPosition_m * kPosition_m * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d gain = prior * (prior + a.covariance_m2).inverse();
  const Eigen::Vector2d along = view.displacement_m.normalized();
  const double limit = kMisplaced * std::sqrt(along.dot((prior + a.covariance_m2) * along));
  if (std::abs(along.dot(a.correction_m)) > limit || a.correction_m.norm() > kMisplaced_m)
    return false;
  // Across the displacement no depth error can look like a shift: what the images say is so.
  const Eigen::Vector2d across(-along.y(), along.x());
  const Eigen::Vector2d moved =
      along * along.dot(gain * a.correction_m) + across * across.dot(a.correction_m);
  const Eigen::Matrix2d left = prior - gain * prior;
  view.displacement_m += moved;
  view.sigma_m = std::sqrt(std::max(0.0, along.dot(left * along)));
  view.noise_grey = a.noise_grey;
  return true;
}

bool unsteady(const std::vector<MotionView>& views, const PlacedImage& image, double longest_m) {
  // Least squares of displacement = velocity x time.
  double tt = 0;
  Eigen::Vector2d td = Eigen::Vector2d::Zero();
  for (const MotionView& v : views) {
    const double t = double(image.exposure - v.image->exposure) * 1e-9;
    tt += t * t;
    td += t * v.displacement_m;
  }
  if (!(tt > 0)) return false;
  const Eigen::Vector2d velocity = td / tt;
  return std::any_of(views.begin(), views.end(), [&](const MotionView& v) {
    const double t = double(image.exposure - v.image->exposure) * 1e-9;
    return (v.displacement_m - velocity * t).norm() > kUnsteady * longest_m;
  });
}

}  // namespace

ViewSet choose_views(const DepthFrame& frame, const PlacedImage& image, const KeyFrames& keys,
                     std::size_t most) {
  ViewSet out;
  const double height_m = std::abs(image.T_map_rectified.translation().z());
  std::vector<MotionView> candidates;
  for (const auto& key : keys.all()) {
    if (key->full.width != image.full.width || key->full.height != image.full.height ||
        key->f_px != image.f_px || key->exposure >= image.exposure)
      continue;
    MotionView v;
    v.image = key;
    v.displacement_m = displacement(image, *key);
    const double far = v.displacement_m.norm();
    if (far >= kShortest * height_m && far <= kLongest * height_m) candidates.push_back(v);
  }
  // Farthest from those that are taken, and from the pair's own baseline.
  std::vector<Eigen::Vector2d> taken = {Eigen::Vector2d::Zero()};
  double noise = 0;
  int aligned = 0;
  while (out.views.size() < most && !candidates.empty()) {
    const auto apart = [&](const MotionView& v) {
      double nearest = 1e9;
      for (const Eigen::Vector2d& t : taken)
        nearest = std::min(nearest, (v.displacement_m - t).norm());
      return nearest;
    };
    const auto next =
        std::max_element(candidates.begin(), candidates.end(),
                         [&](const auto& a, const auto& b) { return apart(a) < apart(b); });
    MotionView view = *next;
    candidates.erase(next);
    taken.push_back(view.displacement_m);
    view.sigma_m = std::sqrt(2.0) * kPosition_m;
    AlignFlaw flaw = AlignFlaw::kTooFew;
    if (const auto a = align(frame, image, *view.image, {}, &flaw)) {
      if (!refine(*a, view)) {
        ++out.misplaced;
        continue;
      }
      noise += a->noise_grey;
      ++aligned;
    } else if (flaw == AlignFlaw::kNoFit) {
      ++out.misplaced;
      continue;
    }
    const Eigen::Vector2d moved = view.displacement_m - displacement(image, *view.image);
    view.warp = warp_between(image.T_map_rectified, view.image->T_map_rectified, moved);
    out.longest_m = std::max(out.longest_m, view.displacement_m.norm());
    out.views.push_back(std::move(view));
  }
  if (aligned > 0) out.noise_grey = std::clamp(noise / aligned, 1.0, 6.0);
  out.proves_rest = unsteady(out.views, image, out.longest_m);
  return out;
}

}  // namespace crane
