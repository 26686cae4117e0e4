// SPDX-License-Identifier: Apache-2.0
#include "mapping/surface_finder.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

/// Share of the samples that a level voxel face gets which a surface must have to be believed.
constexpr double kMinShare = 0.16;
/// A voxel at least so large in the image [px] has samples enough in every other row.
constexpr double kRowsApart = 3;
/// Samples farther apart than this many of their sigmas, and than a voxel, are two surfaces.
constexpr float kApart = 4;
/// A group no thicker than this many sigmas is level, and noise is all its thickness.
constexpr float kLevel = 5;
/// In a wall, a voxel with so many times fewer samples than one beside it holds that one's noise.
constexpr std::size_t kNoiseRatio = 3;

/// A dozen samples, as a rule: insertion is the fastest way then.
template <class Sample>
void sort_by_height(Sample* samples, std::size_t count) {
  const auto lower = [](const Sample& a, const Sample& b) { return a.z_m < b.z_m; };
  if (count > 24) return std::sort(samples, samples + count, lower);
  for (std::size_t i = 1; i < count; ++i) {
    const Sample sample = samples[i];
    std::size_t at = i;
    for (; at > 0 && lower(sample, samples[at - 1]); --at) samples[at] = samples[at - 1];
    samples[at] = sample;
  }
}

}  // namespace

double mean_voxel_px(const DepthFrame& f, double voxel_m) {
  double sum = 0;
  std::uint64_t matched = 0;
  for (std::size_t i = 0; i < std::size_t(f.width) * f.height; i += 97)
    if (f.depth_m[i] > 0) sum += f.depth_m[i], ++matched;
  return matched > 0 ? voxel_m * f.f_px / (sum / double(matched)) : 0;
}

const std::vector<SurfaceHit>& SurfaceFinder::find(const DepthFrame& frame, double voxel_m,
                                                   double voxel_px, const SurfaceSettings& settings,
                                                   SurfaceReport& report) {
  settings_ = settings;
  hits_.clear();
  collect(frame, voxel_m, voxel_px, report);
  if (unsorted_.empty()) return hits_;
  // Counting sort by column.
  start_.assign(std::size_t(columns_) * rows_ + 1, 0);
  for (std::uint32_t c : column_of_) ++start_[c + 1];
  for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
  sorted_.resize(unsorted_.size());
  for (std::size_t i = 0; i < unsorted_.size(); ++i)
    sorted_[start_[column_of_[i]]++] = unsorted_[i];
  std::size_t from = 0;
  for (std::size_t c = 0; c + 1 < start_.size(); ++c) {
    const std::size_t to = start_[c];  // moved on to the end of its column
    if (to > from)
      column(frame, voxel_m, x0_ + static_cast<std::int32_t>(c) % columns_,
             y0_ + static_cast<std::int32_t>(c) / columns_, sorted_.data() + from, to - from,
             report);
    from = to;
  }
  return hits_;
}

void SurfaceFinder::collect(const DepthFrame& f, double voxel_m, double voxel_px,
                            SurfaceReport& report) {
  unsorted_.clear();
  column_of_.clear();
  // About 3 x 3 samples on the face of a voxel are enough for its mean height. Every other row at
  // most: those between are made of their neighbours by the matcher, and say nothing new.
  const std::uint32_t step_u =
      settings_.every_sample ? 1 : std::clamp(static_cast<std::uint32_t>(voxel_px / 3), 1U, 8U);
  const bool alternate = !settings_.every_sample && step_u == 1 && voxel_px >= kRowsApart;
  const std::uint32_t step_v = alternate ? 2 : step_u;
  const double samples = voxel_px * voxel_px / (step_u * step_v);
  // One sample alone is believed only where a voxel has hardly more.
  const double least = samples >= 4 ? 2 : 1;
  min_samples_ = settings_.every_sample
                     ? 1
                     : static_cast<std::uint32_t>(std::max(least, std::round(kMinShare * samples)));

  float farthest = 0;
  for (std::uint32_t v = step_v / 2 & ~1U; v < f.height; v += step_v)
    for (std::uint32_t u = step_u / 2; u < f.width; u += step_u)
      farthest = std::max(farthest, std::abs(f.depth_m[std::size_t(v) * f.width + u]));
  if (!(farthest > 0)) return;
  Eigen::AlignedBox2d box;
  for (int corner = 0; corner < 8; ++corner) {
    const double z = corner < 4 ? 0 : double(farthest);
    const Eigen::Vector3d p =
        f.T_map_rectified *
        Eigen::Vector3d(((corner & 1) * double(f.width) - f.cx_px) / f.f_px * z,
                        ((corner >> 1 & 1) * double(f.height) - f.cy_px) / f.f_px * z, z);
    box.extend(p.head<2>());
  }
  const double inverse_voxel = 1 / voxel_m;
  x0_ = static_cast<std::int32_t>(std::floor(box.min().x() * inverse_voxel)) - 1;
  y0_ = static_cast<std::int32_t>(std::floor(box.min().y() * inverse_voxel)) - 1;
  columns_ = static_cast<std::int32_t>(std::floor(box.max().x() * inverse_voxel)) + 2 - x0_;
  rows_ = static_cast<std::int32_t>(std::floor(box.max().y() * inverse_voxel)) + 2 - y0_;

  // In voxels, relative to the corner of the footprint: single precision is enough there.
  const Eigen::Matrix3f R = (f.T_map_rectified.linear() * inverse_voxel).cast<float>();
  const Eigen::Vector3d t = f.T_map_rectified.translation();
  const Eigen::Vector3f origin(static_cast<float>(t.x() * inverse_voxel - x0_),
                               static_cast<float>(t.y() * inverse_voxel - y0_),
                               static_cast<float>(t.z() * inverse_voxel));
  const auto z_low = static_cast<float>(settings_.z_min_m * inverse_voxel);
  const auto z_high = static_cast<float>(settings_.z_max_m * inverse_voxel);
  const auto voxel = static_cast<float>(voxel_m);
  const auto inverse_f = static_cast<float>(1 / f.f_px);
  const auto sigma_scale = static_cast<float>(255 * f.sigma_disparity_px / (f.f_px * f.baseline_m));
  for (std::uint32_t v = step_v / 2 & ~1U; v < f.height; v += step_v) {
    const float y = (float(v) - float(f.cy_px)) * inverse_f;
    for (std::uint32_t u = step_u / 2; u < f.width; u += step_u) {
      const std::size_t i = std::size_t(v) * f.width + u;
      const float depth = std::abs(f.depth_m[i]);
      if (!(depth > 0)) continue;
      const Eigen::Vector3f p =
          depth * (R.col(0) * ((float(u) - float(f.cx_px)) * inverse_f) + R.col(1) * y + R.col(2)) +
          origin;
      if (p.z() < z_low || p.z() > z_high) {
        ++report.out_of_range;
        continue;
      }
      column_of_.push_back(static_cast<std::uint32_t>(static_cast<std::int32_t>(p.y()) * columns_ +
                                                      static_cast<std::int32_t>(p.x())));
      unsorted_.push_back({p.z() * voxel,
                           sigma_scale * depth * depth / float(std::max<int>(1, f.confidence[i])),
                           static_cast<std::uint32_t>(i)});
    }
  }
  report.points += unsorted_.size();
}

void SurfaceFinder::column(const DepthFrame& f, double voxel_m, std::int32_t x, std::int32_t y,
                           Sample* samples, std::size_t count, SurfaceReport& report) {
  sort_by_height(samples, count);
  const auto voxel = static_cast<float>(voxel_m);
  for (std::size_t from = 0, to = 0; from < count; from = to) {
    float sigma = samples[from].sigma_m;
    for (to = from + 1; to < count; ++to) {
      const float limit =
          std::max(voxel, kApart * std::max(samples[to].sigma_m, samples[to - 1].sigma_m));
      if (samples[to].z_m - samples[to - 1].z_m > limit) break;
      sigma = std::max(sigma, samples[to].sigma_m);
    }
    const std::size_t n = to - from;
    if (n < min_samples_) {
      ++report.weak;
      continue;
    }
    if (!settings_.every_sample &&
        samples[to - 1].z_m - samples[from].z_m <= std::max(voxel, kLevel * sigma)) {
      emit(f, voxel_m, x, y, samples + from, n);
      continue;
    }
    // A wall: the samples of each voxel, but for those that hold the noise of the one beside.
    std::size_t before = 0;
    for (std::size_t a = from, b = a; a < to; a = b) {
      const float end = (std::floor(samples[a].z_m / voxel) + 1) * voxel;
      for (b = a; b < to && samples[b].z_m < end; ++b) {
      }
      if (b == a) ++b;  // on the border, by rounding
      std::size_t after = b;
      while (after < to && samples[after].z_m < end + voxel) ++after;
      after -= b;
      if (b - a < min_samples_ ||
          (!settings_.every_sample && kNoiseRatio * (b - a) < std::max(before, after)))
        ++report.weak;
      else
        emit(f, voxel_m, x, y, samples + a, b - a);
      before = b - a;
    }
  }
}

void SurfaceFinder::emit(const DepthFrame& f, double voxel_m, std::int32_t x, std::int32_t y,
                         const Sample* samples, std::size_t count) {
  float weights = 0;
  float height = 0;
  std::uint32_t colour[3] = {0, 0, 0};
  for (std::size_t i = 0; i < count; ++i) {
    const float weight = 1 / (samples[i].sigma_m * samples[i].sigma_m);
    weights += weight;
    height += weight * samples[i].z_m;
    if (f.colour == nullptr) continue;
    for (std::size_t c = 0; c < 3; ++c)
      colour[c] += f.colour[3 * std::size_t{samples[i].pixel} + c];
  }
  SurfaceHit hit;
  hit.x = x;
  hit.y = y;
  hit.height_m = height / weights;
  hit.z = static_cast<std::int32_t>(std::floor(double(hit.height_m) / voxel_m));
  // Neighbouring pixels share most of their noise: no better than the mean of their variances.
  hit.sigma_m = std::sqrt(float(count) / weights);
  if (f.colour != nullptr) {
    const auto n = static_cast<std::uint32_t>(count);
    hit.b = static_cast<std::uint8_t>(colour[0] / n);
    hit.g = static_cast<std::uint8_t>(colour[1] / n);
    hit.r = static_cast<std::uint8_t>(colour[2] / n);
  }
  hits_.push_back(hit);
}

}  // namespace crane
