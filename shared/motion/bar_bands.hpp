// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "cloud/point_cloud.hpp"

namespace crane {

/// Width of the pieces that bars are looked for in [px].
inline constexpr int kBarPiece = 16;

/// A piece of a band of rows with hardly a match, between others that have one.
struct BarBand {
  int u0 = 0;              ///< first pixel of kBarPiece
  int v0 = 0, v1 = 0;      ///< rows v0 <= v < v1
  float background_m = 0;  ///< depth of what is matched around it, of both sides the nearer
};

/// The bands of one column of pieces, from the top.
std::vector<BarBand> bar_bands(const DepthFrame& frame, const float* depth_m, int u0);

}  // namespace crane
