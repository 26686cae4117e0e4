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

int matched(const float* depth_m) {
  int n = 0;
  for (int x = 0; x < kBarPiece; ++x) n += std::abs(depth_m[x]) > 0 ? 1 : 0;
  return n;
}

/// Median depth of a matched row's pixels.
float row_depth(const float* depth_m) {
  std::array<float, kBarPiece> found{};
  int n = 0;
  for (int x = 0; x < kBarPiece; ++x)
    if (const float z = std::abs(depth_m[x]); z > 0) found[std::size_t(n++)] = z;
  std::nth_element(found.begin(), found.begin() + n / 2, found.begin() + n);
  return found[std::size_t(n / 2)];
}

}  // namespace

std::vector<BarBand> bar_bands(const DepthFrame& f, const float* depth_m, int u0) {
  std::vector<BarBand> out;
  const auto row = [&](int v) { return depth_m + std::size_t(v) * f.width + std::size_t(u0); };
  int begin = -1;    // of the band
  float before = 0;  // depth of the row above it
  int own = 0;       // rows in it that are matched, as a bar's own are
  bool after_match = false;
  for (int v = 0; v < int(f.height); ++v) {
    const bool match = matched(row(v)) >= kFewest;
    if (begin < 0) {
      if (!match && after_match) begin = v, before = row_depth(row(v - 1)), own = 0;
    } else if (match) {
      const float z = row_depth(row(v));
      if (z < kNearer * before) {
        ++own;
        continue;
      }
      if (v - begin >= kShortest && v - begin <= kTallest && own < v - begin)
        out.push_back({u0, begin, v, std::min(before, z)});
      begin = -1;
    }
    after_match = match;
  }
  return out;
}

}  // namespace crane
