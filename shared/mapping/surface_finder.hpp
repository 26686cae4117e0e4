// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "cloud/point_cloud.hpp"

namespace crane {

/// A surface that one frame saw in one voxel.
struct SurfaceHit {
  std::int32_t x = 0, y = 0, z = 0;  ///< voxel
  float height_m = 0;                ///< map z, weighted mean of the samples
  float sigma_m = 0;                 ///< standard deviation of height_m
  std::uint8_t r = 0, g = 0, b = 0;
};

struct SurfaceReport {
  std::uint64_t points = 0;        ///< depth samples used
  std::uint64_t out_of_range = 0;  ///< samples below z_min or above z_max
  std::uint64_t weak = 0;          ///< groups of too few samples to be believed
};

struct SurfaceSettings {
  double z_min_m = -0.3, z_max_m = 2;  ///< heights outside are left out
  /// Every voxel with a depth sample is a surface, as in OctoMap: no noise, no groups.
  bool every_sample = false;
};

/// Edge of a voxel in the image at the mean depth [px]; 0 = nothing matched.
double mean_voxel_px(const DepthFrame& frame, double voxel_m);

/// Depth samples of one frame to surfaces, column by column of the map. Samples of a column that
/// differ no more than their noise are one level surface at their weighted mean: a floor far away
/// stays one voxel thick. Samples that differ more are a wall: each voxel with enough of them.
/// Noise: sigma_z = z^2 / (f b) * sigma_d, sigma_d of each sample from its confidence.
/// Keeps its memory between frames. Cost O(samples).
class SurfaceFinder {
 public:
  /// `voxel_px`: mean_voxel_px().
  const std::vector<SurfaceHit>& find(const DepthFrame& frame, double voxel_m, double voxel_px,
                                      const SurfaceSettings& settings, SurfaceReport& report);

 private:
  struct Sample {
    float z_m, sigma_m;
    std::uint32_t pixel;
  };
  void collect(const DepthFrame& frame, double voxel_m, double voxel_px, SurfaceReport& report);
  void column(const DepthFrame& frame, double voxel_m, std::int32_t x, std::int32_t y,
              Sample* samples, std::size_t count, SurfaceReport& report);
  void emit(const DepthFrame& frame, double voxel_m, std::int32_t x, std::int32_t y,
            const Sample* samples, std::size_t count);

  SurfaceSettings settings_;
  std::uint32_t min_samples_ = 1;
  std::int32_t x0_ = 0, y0_ = 0, columns_ = 0, rows_ = 0;  ///< of the map, seen by this frame
  std::vector<Sample> unsorted_, sorted_;
  std::vector<std::uint32_t> column_of_, start_;
  std::vector<SurfaceHit> hits_;
};

}  // namespace crane
