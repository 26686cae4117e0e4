// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "motion/placed_image.hpp"

namespace crane {

struct AlignSettings {
  /// Looks so far around the stated place first [m]; 0: it is right to about four pixels.
  double reach_m = 0;
};

/// How one placed frame really lies to another, as their images tell.
struct Alignment {
  Eigen::Vector2d displacement_m =
      Eigen::Vector2d::Zero();  ///< of the frame from the other, map x, y
  Eigen::Vector2d correction_m = Eigen::Vector2d::Zero();  ///< that minus what the positions say
  /// Of both, map x, y. Along the displacement it contains what the pair's disparities, all wrong
  /// by a tenth of a pixel, would make of it.
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  double sigma_m = 0;      ///< in the direction that is known worst
  double support = 0;      ///< share of the patches whose brightness it explains
  double noise_grey = 0;   ///< of a pixel, from what is left of the patches
  int patches = 0;         ///< with texture and depth, in both images
  bool ambiguous = false;  ///< reach_m > 0: fits elsewhere nearly as well, as on a pattern
};

/// Why there is no alignment.
enum class AlignFlaw {
  kTooFew,  ///< patches with texture and depth in both images
  kNoFit,   ///< enough of them, but they do not fit
};

/// Sub-pixel displacement between two placed frames: textured patches of `image` (that of `frame`,
/// which gives the depths; likely ones count as well) are moved into `other`, and the place is
/// corrected until they fit, by Gauss-Newton on brightness (Lucas and Kanade 1981) over all patches
/// in one; those that moved by themselves or are hidden lose their weight. The rotation is taken as
/// it is said. Nothing, and `flaw`, when fewer than 12 patches lie in both images, or they do not
/// fit. Cost about 0.3 ms; with reach_m some milliseconds.
std::optional<Alignment> align(const DepthFrame& frame, const PlacedImage& image,
                               const PlacedImage& other, const AlignSettings& settings = {},
                               AlignFlaw* flaw = nullptr);

}  // namespace crane
