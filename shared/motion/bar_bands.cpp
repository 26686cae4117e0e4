// SPDX-License-Identifier: Apache-2.0
#include "motion/bar_bands.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace crane {
namespace {

constexpr int kShortest = 2, kTallest = 32;  ///< rows
constexpr int kFewest = kBarPiece * 5 / 8;   ///< pixels of a matched row
constexpr float kNearer = 0.985F;            ///< of a depth: something else, before it

/// Median depth of a row's pixels; 0: hardly any is matched.
float row_depth(const float* depth_m) {
  std::array<float, kBarPiece> found{};
  int n = 0;
  for (int x = 0; x < kBarPiece; ++x)
    if (const float z = std::abs(depth_m[x]); z > 0) found[std::size_t(n++)] = z;
  if (n < kFewest) return 0;
  std::nth_element(found.begin(), found.begin() + n / 2, found.begin() + n);
  return found[std::size_t(n / 2)];
}

}  // namespace

std::vector<BarBand> bar_bands(const DepthFrame& f, const float* depth_m, int u0) {
  std::vector<BarBand> out;
  float above = 0;  // depth of the last matched row that is background
  int begin = -1;
  int matched_in = 0;
  for (int v = 0; v < int(f.height); ++v) {
    const float z = row_depth(depth_m + std::size_t(v) * f.width + std::size_t(u0));
    if (begin >= 0 && (z <= 0 || z < kNearer * above)) {
      // A bar's own matches are no end of its band.
      matched_in += z > 0 ? 1 : 0;
      continue;
    }
    if (z <= 0) {
      if (above > 0) begin = v, matched_in = 0;
      continue;
    }
    if (begin >= 0 && v - begin >= kShortest && v - begin <= kTallest && matched_in < v - begin)
      out.push_back({u0, begin, v, std::min(above, z)});
    begin = -1;
    above = z;
  }
  return out;
}

}  // namespace crane
