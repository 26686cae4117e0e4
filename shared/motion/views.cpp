// SPDX-License-Identifier: Apache-2.0
#include "motion/views.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/threads.hpp"

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

/// Each time the farthest from those before it, and from the pair's own baseline.
void put_different_first(std::vector<MotionView>& views) {
  std::vector<Eigen::Vector2d> taken = {Eigen::Vector2d::Zero()};
  const auto apart = [&](const MotionView& v) {
    double nearest = 1e9;
    for (const Eigen::Vector2d& t : taken)
      nearest = std::min(nearest, (v.displacement_m - t).norm());
    return nearest;
  };
  for (auto at = views.begin(); at != views.end(); ++at) {
    const auto next = std::max_element(
        at, views.end(), [&](const auto& a, const auto& b) { return apart(a) < apart(b); });
    std::rotate(at, next, next + 1);
    taken.push_back(at->displacement_m);
  }
}

enum class Fit { kUnknown, kAligned, kElsewhere };

/// Refines the view's place; kUnknown: the images do not tell, it stays as the rangefinders say.
Fit fit(const DepthFrame& frame, const PlacedImage& image, MotionView& view) {
  AlignFlaw flaw = AlignFlaw::kTooFew;
  if (const auto a = align(frame, image, *view.image, {}, &flaw))
    return refine(*a, view) ? Fit::kAligned : Fit::kElsewhere;
  return flaw == AlignFlaw::kNoFit ? Fit::kElsewhere : Fit::kUnknown;
}

}  // namespace

ViewSet choose_views(const DepthFrame& frame, const PlacedImage& image, const KeyFrames& keys,
                     std::size_t most, int threads) {
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
    v.sigma_m = std::sqrt(2.0) * kPosition_m;
    const double far = v.displacement_m.norm();
    if (far >= kShortest * height_m && far <= kLongest * height_m) candidates.push_back(v);
  }
  put_different_first(candidates);
  double noise = 0;
  int aligned = 0;
  // As many at once as may be needed yet.
  for (std::size_t from = 0; out.views.size() < most && from < candidates.size();) {
    const std::size_t count = std::min(most - out.views.size(), candidates.size() - from);
    std::vector<Fit> fits(count);
    std::atomic<std::size_t> next{0};
    on_threads(std::min(threads, int(count)), [&](int, Meeting&) {
      for (std::size_t i = next++; i < count; i = next++)
        fits[i] = fit(frame, image, candidates[from + i]);
    });
    for (std::size_t i = 0; i < count; ++i) {
      MotionView& view = candidates[from + i];
      if (fits[i] == Fit::kElsewhere) {
        ++out.misplaced;
        continue;
      }
      if (fits[i] == Fit::kAligned) noise += view.noise_grey, ++aligned;
      const Eigen::Vector2d moved = view.displacement_m - displacement(image, *view.image);
      view.warp = warp_between(image.T_map_rectified, view.image->T_map_rectified, moved);
      out.longest_m = std::max(out.longest_m, view.displacement_m.norm());
      out.views.push_back(std::move(view));
    }
    from += count;
  }
  if (aligned > 0) out.noise_grey = std::clamp(noise / aligned, 1.0, 6.0);
  out.proves_rest = unsteady(out.views, image, out.longest_m);
  return out;
}

}  // namespace crane
