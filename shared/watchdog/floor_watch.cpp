// SPDX-License-Identifier: Apache-2.0
#include "watchdog/floor_watch.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

/// Edge of a place, as a share of the camera's height.
constexpr double kPlace = 0.08;
constexpr std::size_t kMostPlaces = 8192, kLeastPlaces = 60, kLeastFrames = 3;
/// The floor's heights lie within this share of the camera's height, at a share of all places.
constexpr double kFloorBand = 0.02, kFloorShare = 0.2;
/// The floor is looked for up to this share of the camera's height; what is higher is no floor.
constexpr double kFloorReach = 0.3;
/// A floor that lies higher than 0, or deeper than this share, must be that of more than one view:
/// so many times the places that the first one showed.
constexpr double kDeep = 0.05, kWide = 1.2;
/// Places weigh at most so many frames: what is said is of late.
constexpr float kMostWeight = 20;
constexpr std::size_t kKept = 8;  ///< views to compare with
constexpr double kApart = 0.12;   ///< as a share of the height: views nearer tell nothing
constexpr int kLeastCells = 25;
constexpr double kForget = 0.995;  ///< from pair to pair
/// Disparities err together, by their being drawn to whole pixels [share of one's sigma].
constexpr double kTogether = 0.7;

std::uint64_t key_of(double x, double y, double edge) {
  const auto a = static_cast<std::int32_t>(std::floor(x / edge));
  const auto b = static_cast<std::int32_t>(std::floor(y / edge));
  return std::uint64_t(static_cast<std::uint32_t>(a)) << 32U | static_cast<std::uint32_t>(b);
}

template <class T>
T quantile(std::vector<T>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

void FloorWatch::clear() {
  *this = FloorWatch(height_m_);
}

/// Of the heights that many places have, the one nearest to 0: platforms lie higher, pits lower.
std::optional<double> FloorWatch::floor_of(std::vector<float>& heights) const {
  if (heights.size() < kLeastPlaces) return std::nullopt;
  std::sort(heights.begin(), heights.end());
  const double band = std::max(2 * kFloorBand * height_m_, 6 * sigma_m_);
  const auto least = static_cast<std::size_t>(kFloorShare * double(heights.size()));
  std::optional<double> floor;
  std::size_t best = 0;  // of those that overlap
  double from = 0;
  double candidate = 0;
  const auto settle = [&] {
    if (best >= least && (!floor || std::abs(candidate) < std::abs(*floor))) floor = candidate;
  };
  for (std::size_t i = 0, end = 0; i < heights.size(); ++i) {
    if (heights[i] > kFloorReach * height_m_) break;
    while (end < heights.size() && heights[end] - heights[i] < band) ++end;
    const std::size_t count = end - i;
    if (best > 0 && heights[i] > from + band) {
      settle();
      best = 0;
    }
    if (count <= best) continue;
    best = count;
    from = heights[i];
    candidate = heights[i + count / 2];
  }
  settle();
  return floor;
}

void FloorWatch::add_places(const FrameView& view) {
  const double edge = kPlace * height_m_;
  if (places_.size() > kMostPlaces) places_.clear();
  if (places_.empty()) view_places_ = 0;
  for (const ViewCell& c : view.cells) {
    if (!c.flat) continue;
    Place& place = places_[key_of(c.map_m.x(), c.map_m.y(), edge)];
    place.weight = std::min(place.weight + 1, kMostWeight);
    place.z_m += (c.map_m.z() - place.z_m) / place.weight;
  }
  if (view_places_ == 0) view_places_ = places_.size();
  std::vector<float> heights;
  heights.reserve(places_.size());
  for (const auto& [key, place] : places_) heights.push_back(place.z_m);
  const std::size_t seen = heights.size();
  const auto floor = floor_of(heights);
  finding_.height_m = {};
  finding_.places = 0;
  if (!floor || finding_.frames < kLeastFrames) return;
  const double band = std::max(kFloorBand * height_m_, 3 * sigma_m_);
  std::erase_if(heights, [&](float z) { return std::abs(z - *floor) > band; });
  finding_.places = heights.size();
  // What lies nearest to 0 of the middle half: a floor that is low in places is no wrong height.
  const double low = quantile(heights, 0.25);
  const double high = quantile(heights, 0.75);
  const double off = low > 0 ? low : high < 0 ? high : 0;
  const double scatter = (high - low) / 1.35;
  // What fills one view and lies higher may be a platform, and what lies far lower a pit.
  const bool doubtful = off > 0 || off < -kDeep * height_m_;
  if (doubtful && double(seen) < kWide * double(view_places_)) return;
  finding_.height_m = {
      off, std::hypot(scatter / std::sqrt(double(heights.size())), kTogether * sigma_m_)};
}

/// Slope and bend of the floor in a single frame.
void FloorWatch::fit_frame(const FrameView& view) {
  std::vector<float> heights;
  for (const ViewCell& c : view.cells)
    if (c.flat) heights.push_back(c.map_m.z());
  const auto floor = floor_of(heights);
  if (!floor) return;
  const Eigen::Vector2d middle = view.T_map_rectified.translation().head<2>();
  const double band = std::max(2.5 * kFloorBand * height_m_, 4 * sigma_m_);
  Eigen::Vector4d fit(*floor, 0, 0, 0);
  double count = 0;
  for (int round = 0; round < 4; ++round) {
    Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
    Eigen::Vector4d rhs = Eigen::Vector4d::Zero();
    count = 0;
    for (const ViewCell& c : view.cells) {
      if (!c.flat) continue;
      const Eigen::Vector2d d = (c.map_m.head<2>().cast<double>() - middle) / height_m_;
      const Eigen::Vector4d row(1, d.x(), d.y(), d.x() * d.x());
      const double off = c.map_m.z() - row.dot(fit);
      if (std::abs(off) > band / (1 << round)) continue;
      N += row * row.transpose();
      rhs += row * c.map_m.z();
      ++count;
    }
    if (count < 2 * kLeastCells) return;
    N.diagonal().array() += 1e-6;
    fit = N.ldlt().solve(rhs);
  }
  const Eigen::Vector3d shape = fit.tail<3>();
  shape_ = kForget * shape_ + shape;
  shape_squares_ = kForget * shape_squares_ + shape.cwiseProduct(shape);
  shape_count_ = kForget * shape_count_ + 1;
  const Eigen::Vector3d mean = shape_ / shape_count_;
  const Eigen::Vector3d var =
      (shape_squares_ / shape_count_ - mean.cwiseProduct(mean)).cwiseMax(0) / shape_count_;
  // How far aside the view reaches, as a share of the height.
  const double aside = view.columns * view.edge_px / 2 / view.f_px;
  const double down = view.rows * view.edge_px / 2 / view.f_px;
  const auto figure = [&](int i, double unit, double lever) {
    return Figure{mean[i] / unit,
                  std::hypot(std::sqrt(var[i]), 0.5 * kTogether * sigma_m_ / lever) / unit};
  };
  finding_.seen_slope_x = figure(0, height_m_, aside);
  finding_.seen_slope_y = figure(1, height_m_, down);
  finding_.bend_m = figure(2, 1, aside * aside);
}

/// The same places from two positions: what is sloped there has the same height from both.
void FloorWatch::compare(const FrameView& view, const FrameView& before) {
  const Eigen::Vector2d moved_m =
      (view.T_map_rectified.translation() - before.T_map_rectified.translation()).head<2>();
  if (moved_m.norm() < kApart * height_m_) return;
  std::vector<double> off;
  const double near = 0.6 * view.edge_px / view.f_px * height_m_;
  for (const ViewCell& c : view.cells) {
    if (!c.flat) continue;
    const ViewCell* there = before.showing(c.map_m.cast<double>());
    if (there == nullptr || !there->flat) continue;
    const Eigen::Vector3f d = c.map_m - there->map_m;
    // Whose heights differ much is not the same thing.
    if (d.head<2>().norm() > near || std::abs(d.z()) > 0.08 * height_m_) continue;
    off.push_back(double(d.z()));
  }
  if (off.size() < std::size_t(kLeastCells)) return;
  const double dz = quantile(off, 0.5);
  again_ = kForget * again_ + moved_m * moved_m.transpose();
  again_rhs_ = kForget * again_rhs_ - moved_m * dz;
  again_sum_ = kForget * again_sum_ + dz * dz;
  again_count_ = kForget * again_count_ + 1;
}

void FloorWatch::add(const FrameView& view, double sigma_m) {
  sigma_m_ = sigma_m;
  ++finding_.frames;
  add_places(view);
  fit_frame(view);
  for (const FrameView& before : before_) compare(view, before);
  const auto apart = [&](const FrameView& v) {
    return (view.T_map_rectified.translation() - v.T_map_rectified.translation()).norm() >
           kApart * height_m_;
  };
  if (before_.empty() || apart(before_.back())) {
    before_.push_back(view);
    if (before_.size() > kKept) before_.pop_front();
  }
  if (again_count_ < 2) return;
  // A ridge of what moves by a twentieth of the height: an axis that stood says nothing.
  const double ridge = again_count_ * std::pow(0.05 * height_m_, 2) * 0.05;
  const Eigen::Matrix2d N = again_ + ridge * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d inverse = N.inverse();
  const Eigen::Vector2d slope = inverse * again_rhs_;
  const double rest = std::max(0.0, again_sum_ - slope.dot(again_rhs_)) / again_count_;
  // Views that share a frame err together: a tenth of the pairs count.
  const double noise = std::hypot(std::sqrt(rest), 0.3 * kTogether * sigma_m_);
  const double independent = std::max(1.0, again_count_ / 10);
  const auto figure = [&](int i) {
    const double sigma = noise * std::sqrt(inverse(i, i) * again_count_ / independent);
    return again_(i, i) > 4 * ridge ? Figure{slope[i], sigma} : Figure{};
  };
  finding_.slope_x = figure(0);
  finding_.slope_y = figure(1);
}

}  // namespace crane
