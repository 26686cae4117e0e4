// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/bundle.hpp"

namespace crane {

/// A figure over the left image: `columns` x `rows` points, row by row, the outer ones on its
/// border.
struct ImageGrid {
  int columns = 0, rows = 0;
  std::vector<double> values;

  [[nodiscard]] double worst() const;
  [[nodiscard]] double median() const;
  /// 95 % of the image has no more: its outermost corners are seldom seen and never well known.
  [[nodiscard]] double most() const;
};

/// How surely the left camera's direction of each pixel is known [px, 1 sigma], the worse of both
/// axes, but for a turn of the whole camera, which the mount's calibration finds. Source: mrcal's
/// projection uncertainty at infinity (Kogan, doc/uncertainty), here with the rotation that fits
/// best taken out.
ImageGrid direction_sigma(const RigEstimate& rig, const ImageSize& size);

/// What the calibration's uncertainty means for a floor at `distance_m`: 1 sigma of its height [m].
ImageGrid height_sigma(const RigEstimate& rig, const ImageSize& size, double distance_m);

/// How far another calibration of the same cameras puts that floor from where this one does [m].
ImageGrid height_difference(const RigEstimate& rig, const RigEstimate& other, const ImageSize& size,
                            double distance_m);

}  // namespace crane
